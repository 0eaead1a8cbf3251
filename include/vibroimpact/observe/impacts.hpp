// Impacts at upper stops (A) and lower stops (B), all contacts; completed chatter is one.
#pragma once

#include "vibroimpact/observe/observer.hpp"

namespace vi::observe {

struct impacts {
    static constexpr const char* name = "impacts";
    result_table per_period{}; // at A, at B; without forcing per unit of time

    void tables(const batch_sizes&, const auto& to) { to("per_period", per_period, 2); }

    template <class Flow>
    struct observer {
        long upper = 0, lower = 0;

        VI_HD void on_event(const event_view<Flow>& s) {
            if (!counts_as_impact(s.e.what)) return;
            upper += s.e.side > 0;
            lower += s.e.side < 0;
        }
        VI_HD void write(const auto& m, const impacts& to) const {
            const double periods = m.duration / m.period;
            to.per_period.put(m.row, upper / periods, lower / periods);
        }
    };
};

} // namespace vi::observe
