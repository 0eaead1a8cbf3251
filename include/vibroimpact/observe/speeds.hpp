// Statistics of impact speeds: the rate at which the gap closed.
//
// Method      speed = -rate_before of every impact; of simultaneous ones that of the contact found
//             first. Completed chatter has no single speed and is left out.
#pragma once

#include "vibroimpact/observe/event_view.hpp"

namespace vi {

struct impact_speeds {
    long count = 0;
    double sum = 0.0, squares = 0.0;
    double smallest = infinity(), largest = 0.0;

    template <class Flow>
    VI_HD void see(const scene<Flow>& s) {
        if (s.e.what != status::impact && s.e.what != status::simultaneous) return;
        const double speed = -s.e.rate_before;
        ++count;
        sum = sum + speed;
        squares = squares + speed * speed;
        smallest = min(smallest, speed);
        largest = max(largest, speed);
    }
};

} // namespace vi
