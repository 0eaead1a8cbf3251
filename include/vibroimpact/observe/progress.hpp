// Drift of u = row . (x, v, a) per forcing period, without forcing per unit of time.
//
// Method      (u at the end - u at the begin of the window) / its length
// Accuracy    rounding of u
#pragma once

#include "vibroimpact/observe/observer.hpp"

namespace vi::observe {

struct progress {
    static constexpr const char* name = "progress";
    static constexpr int most_rows = 16;
    row_list rows{};
    result_table per_period{}; // of every row

    void options(const auto& to) { to.rows("rows", rows, most_rows); }
    void tables(const batch_sizes&, const auto& to) { to("per_period", per_period, rows.count); }
    template <class Flow>
    struct observer;
};

template <class Flow>
struct progress::observer {
    watched_rows<Flow> watched{};
    double first[most_rows] = {};
    bool begun = false;

    VI_HD void on_flight(const flight_segment<Flow>& s) {
        if (begun) return;
        begun = true;
        for (int i = 0; i < watched.count; ++i)
            first[i] = guard_value(watched.of_mode(s.mode)[i], 0, s.y, s.system.dimension());
    }
    VI_HD void write(const auto& m, const progress& to) const {
        const double periods = m.duration / m.period;
        double* row = to.per_period.row(m.row);
        for (int i = 0; i < watched.count; ++i) {
            const auto& u = watched.of_mode(m.at.mode)[i];
            row[i] = (guard_value(u, 0, m.at.y, m.system.dimension()) - first[i]) / periods;
        }
    }
};

} // namespace vi::observe
