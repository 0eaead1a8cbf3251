// The smallest and the largest force of every contact and element; impulses of impacts are none.
//
// Method      extremes.hpp, on the forces of part_forces.hpp; a force is zero where its part does not act
// Accuracy    that of extremes.hpp
#pragma once

#include "vibroimpact/observe/extremes.hpp"
#include "vibroimpact/observe/part_forces.hpp"

namespace vi::observe {

struct forces {
    static constexpr const char* name = "forces";
    result_table ranges{}; // smallest and largest of every part

    void tables(const batch_sizes& n, const auto& to) {
        to("ranges", ranges, 2 * (n.contacts + n.elements));
    }

    template <class Flow>
    struct observer {
        element_rows rows{};
        range of[detail::most_parts<Flow>];

        VI_HD void prepare(const forces&, const member_start<Flow>& m) { rows = m.elements; }
        VI_HD void on_flight(const flight_segment<Flow>& s) {
            if (!(s.duration > 0.0)) return;
            bool acts[detail::most_parts<Flow>] = {};
            detail::each_force(s, rows,
                               [&](int part, const taylor_polynomial& f, double span, double unit) {
                                   acts[part] = true;
                                   include_step(of[part], f, span / unit);
                               });
            for (int part = 0; part < s.system.contacts() + rows.elements; ++part)
                if (!acts[part]) of[part].include(0.0);
        }
        VI_HD void write(const auto& m, const forces& to) const {
            double* row = to.ranges.row(m.row);
            for (long long k = 0; 2 * k < to.ranges.width; ++k) {
                const bool seen = of[k].low <= of[k].high;
                row[2 * k] = seen ? of[k].low : not_a_number();
                row[2 * k + 1] = seen ? of[k].high : not_a_number();
            }
        }
    };
};

} // namespace vi::observe
