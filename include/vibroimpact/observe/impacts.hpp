// Impacts at upper stops (A) and lower stops (B), all contacts; completed chatter is one.
#pragma once

#include "vibroimpact/observe/event_view.hpp"

namespace vi {

struct impact_counts {
    long upper = 0, lower = 0;

    template <class Flow>
    VI_HD void see(const scene<Flow>& s) {
        if (!counts_as_impact(s.e.what)) return;
        upper += s.e.side > 0;
        lower += s.e.side < 0;
    }
};

} // namespace vi
