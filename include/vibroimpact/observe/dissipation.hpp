// Work that soft stops and friction take from the motion: what they dissipate, and store meanwhile.
//
// Method      f is the force of an element along its row, w the speed at which it works: that at which a
//             soft stop is pressed, relative to its motion, or the slip speed
//                 work = -integral of f w                                                      (1)
//             with the quadrature of rms.hpp in every step, where both are Taylor polynomials.
// Accuracy    that of rms.hpp. A soft stop that lets go while it is compressed keeps k/2 d^2, which
//             its dashpot dissipates afterwards: this counts as work at once.
#pragma once

#include "vibroimpact/observe/part_forces.hpp"
#include "vibroimpact/observe/rms.hpp"

namespace vi::observe {

struct dissipation {
    static constexpr const char* name = "dissipation";
    result_table work{}; // of each element, per unit of time

    void tables(const batch_sizes& n, const auto& to) { to("work", work, n.elements); }

    template <class Flow>
    struct observer {
        static constexpr int most = Flow::shape_type::max_elements;
        element_rows rows{};
        double taken[most > 0 ? most : 1] = {};

        VI_HD void prepare(const dissipation&, const member_start<Flow>& m) { rows = m.elements; }
        VI_HD void on_flight(const flight_segment<Flow>& s) {
            if constexpr (most > 0)
                march(s, [&](const auto& y, double span) {
                    const auto& flow = s.system.modes[s.mode].flow;
                    const detail::state_derivatives<Flow> at(flow, y);
                    for (int e = 0; e < rows.elements; ++e) {
                        const double *force = rows.force(s.mode, e), *speed = rows.speed(s.mode, e);
                        if (at.is_zero(force) || at.is_zero(speed)) continue;
                        taken[e] = taken[e] - product(at.of(force), at.of(speed), span,
                                                      unit_of_time(flow.step));
                    }
                });
        }
        VI_HD void write(const auto& m, const dissipation& to) const {
            double* row = to.work.row(m.row);
            for (long long e = 0; e < to.work.width; ++e)
                row[e] = taken[e] / m.duration;
        }

    private:
        VI_HD static double product(const taylor_polynomial& f, const taylor_polynomial& w,
                                    double span, double unit) {
            double sum = 0.0;
            each_node(span / unit, [&](double t, double weight) {
                sum = sum + weight * (evaluate(f, 0, t) * evaluate(w, 0, t));
            });
            return span / 2.0 * sum;
        }
    };
};

} // namespace vi::observe
