// Statistics of impact speeds: the rate at which the gap closed.
//
// Method      speed = -rate_before of every impact; of simultaneous ones that of the contact found
//             first; at a soft stop that with which it is met. Completed chatter has no single
//             speed and is left out.
#pragma once

#include "vibroimpact/observe/observer.hpp"

namespace vi::observe {

struct speeds {
    static constexpr const char* name = "speeds";
    result_table statistics{}; // mean, rms, smallest, largest

    void tables(const batch_sizes&, const auto& to) { to("statistics", statistics, 4); }

    template <class Flow>
    struct observer {
        long count = 0;
        double sum = 0.0, squares = 0.0;
        double smallest = infinity(), largest = 0.0;

        VI_HD void on_event(const event_view<Flow>& s) {
            if (!counts_as_impact(s.e.what) || s.e.what == status::chatter) return;
            const double speed = -s.e.rate_before;
            ++count;
            sum = sum + speed;
            squares = squares + speed * speed;
            smallest = min(smallest, speed);
            largest = max(largest, speed);
        }
        VI_HD void write(const auto& m, const speeds& to) const {
            if (count == 0) return;
            const auto n = static_cast<double>(count);
            to.statistics.put(m.row, sum / n, sqrt(squares / n), smallest, largest);
        }
    };
};

} // namespace vi::observe
