// Time at rest on a stop, and how often chatter was completed and a stop grazed.
#pragma once

#include "vibroimpact/observe/event_view.hpp"

namespace vi {

struct shares {
    double at_rest = 0.0; // time with at least one contact closed
    long chatters = 0, grazes = 0;

    template <class Flow>
    VI_HD void see(const stretch<Flow>& s) {
        if (s.mode != 0) at_rest = at_rest + s.duration;
    }
    template <class Flow>
    VI_HD void see(const scene<Flow>& s) {
        chatters += s.e.what == status::chatter;
        grazes += s.e.what == status::grazing;
    }
};

} // namespace vi
