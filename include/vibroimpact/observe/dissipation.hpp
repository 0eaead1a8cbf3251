// Work that soft stops and friction take from the motion: what they dissipate, and store meanwhile.
//
// Method      w is the speed at which a soft stop is pressed, relative to its motion, or the slip speed;
//             d the depth. During a flight in one state
//                 soft stop   work = k/2 (d_end^2 - d_begin^2) + c integral of w^2              (1)
//                 friction    work = F |integral of w|                                          (2)
//             with the quadrature of rms.hpp in every step, where w is a Taylor polynomial: its
//             derivatives are r B^m (B y + b), r the row of w.
// Assumes     mode 0 has every soft stop open and friction slipping: its watches are the gap, whose
//             first derivative is w, and the slip speed
// Accuracy    that of rms.hpp. A soft stop that lets go while it is compressed keeps k/2 d^2, which
//             its dashpot dissipates afterwards: this counts as work at once.
#pragma once

#include "vibroimpact/observe/rms.hpp"

namespace vi {

namespace detail {

// row . y and its derivatives along a flow, row being one of any mode with the same coordinates.
template <class Flow, int D>
VI_HD inline taylor_polynomial derivatives_along(const Flow& flow, const vec<double, D>& row,
                                                 double gain, const vec<double, D>& y) {
    const int n = flow.dimension();
    taylor_polynomial out{};
    out.d[0] = dot(row, y, n, gain);
    auto z = flow.derivative(y);
    for (int m = 1; m <= taylor_order; ++m) {
        out.d[m] = dot(row, z, n);
        auto next = z;
        for (int i = 0; i < n; ++i)
            next[i] = dot(flow.b[i], z, n);
        z = next;
    }
    return out;
}

} // namespace detail

namespace observe {

struct dissipation {
    static constexpr const char* name = "dissipation";
    result_table work{}; // of each element, per unit of time

    void tables(const batch_sizes& n, const auto& to) { to("work", work, n.elements); }

    template <class Flow>
    struct observer {
        static constexpr int most = Flow::shape_type::max_elements;
        double taken[most > 0 ? most : 1] = {};

        VI_HD void on_flight(const flight_segment<Flow>& s) {
            if constexpr (most > 0) {
                int code = s.system.codes[s.mode] / s.system.closed_sets();
                for (int e = 0; e < s.system.elements.count; ++e, code = code / radix)
                    take(s, e, code % radix);
            }
        }
        VI_HD void write(const auto& m, const dissipation& to) const {
            double* row = to.work.row(m.row);
            for (long long e = 0; e < to.work.width; ++e)
                row[e] = taken[e] / m.duration;
        }

    private:
        VI_HD void take(const flight_segment<Flow>& s, int e, int state) {
            const auto& free = s.system.modes[0].watched;
            const auto& flow = s.system.modes[s.mode].flow;
            const bool soft = s.system.elements.soft[e];
            if (soft ? state != 1 && state != 2 : state > 1) return; // open, behind, or sticking
            const double* law = s.system.elements.law[e] + (soft == (state == 1) ? 3 : 0);
            int j = 0;
            while (free.at[j].element != e)
                ++j;
            const auto& g = free.at[j].row;
            integrals of;
            march(s, [&](const auto& y, double span) {
                of.include(detail::derivatives_along(flow, g.rows[soft], g.gains[soft], y), span);
            });
            if (!soft) {
                taken[e] = taken[e] + law[1] * abs(of.first);
                return;
            }
            const int n = s.system.dimension();
            const auto end = flow.flight(s.y, s.duration);
            const double a = guard_value(g, 0, s.y, n) - law[2];
            const double b = guard_value(g, 0, end, n) - law[2];
            taken[e] = taken[e] + (0.5 * law[0] * (b - a) * (b + a) + law[1] * of.second);
        }
    };
};

} // namespace observe
} // namespace vi
