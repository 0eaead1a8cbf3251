// The smallest and the largest value of u = row . (x, v, a) + gain between two times, flights included.
//
// Method      In every step u is a Taylor polynomial (search/polynomial.hpp). The step is cut into
//             pieces [0, L] until each is one of these, with |u''| <= M on it
//               inside    max(u(0), u(L)) + L^2/8 M is not above the largest value so far, and
//                         likewise below: nothing new                                          (1)
//               monotone  |u'(0)| > L M: the ends are the extremes                             (2)
//               bent      u'' keeps its sign: at most one extremum, where u' = 0, located      (3)
//               tiny      L below 2^-24 of a step: an extremum exceeds the ends by L^2/8 M     (4)
// Accuracy    rounding of u; (4) neglects less than 2^-52 of the terms of u
// Reference   search/first_root.hpp, which bounds u'' in the same way
#pragma once

#include "vibroimpact/observe/observer.hpp"

namespace vi {

struct range {
    double low = infinity(), high = -infinity();

    VI_HD void include(double u) {
        low = min(low, u);
        high = max(high, u);
    }
};

namespace detail {

// One piece: true if it is settled, false if it has to be cut.
VI_HD inline bool include_piece(range& seen, const taylor_polynomial& u, double length, bool tiny) {
    const double end = evaluate(u, 0, length);
    seen.include(end);
    const double bend = u.d[2] + u.d[3] * length;
    const double spread = fourth_derivative_bound(u, length) * length * length / 2.0;
    const double lowest = min(u.d[2], bend - spread), highest = max(u.d[2], bend + spread);
    const double steepest = max(abs(lowest), abs(highest)); // M
    const double bulge = steepest * length * length / 8.0;
    if (max(u.d[0], end) + bulge <= seen.high && min(u.d[0], end) - bulge >= seen.low) return true;
    if (tiny || abs(u.d[1]) > steepest * length) return true; // (4), (2)
    if (lowest < 0.0 && highest > 0.0) return false;
    const double slope = evaluate(u, 1, length); // (3)
    if ((u.d[1] > 0.0 && slope < 0.0) || (u.d[1] < 0.0 && slope > 0.0))
        seen.include(evaluate(u, 0, sign_change(u, 1, 0.0, length)));
    return true;
}

} // namespace detail

VI_HD inline void include_step(range& seen, taylor_polynomial u, double span) {
    const double smallest = span * 0x1p-24;
    double from = 0.0, length = span;
    seen.include(u.d[0]);
    while (from < span) {
        if (!detail::include_piece(seen, u, length, length <= smallest)) {
            length = length / 2.0;
            continue;
        }
        if (from + length >= span) return;
        u = recentred(u, length);
        from = from + length;
        length = min(2.0 * length, span - from);
    }
}

namespace observe {

struct extremes {
    static constexpr const char* name = "extremes";
    static constexpr int most_rows = 16;
    row_list rows{};
    result_table ranges{}; // smallest and largest of every row

    void options(const auto& to) { to.rows("rows", rows, most_rows); }
    void tables(const batch_sizes&, const auto& to) { to("ranges", ranges, 2 * rows.count); }
    template <class Flow>
    struct observer;
};

template <class Flow>
struct extremes::observer {
    watched_rows<Flow> watched{};
    range of[most_rows];

    VI_HD void on_flight(const flight_segment<Flow>& s) {
        if (!(s.duration > 0.0)) return; // between events at once nothing lasts
        const auto* rows = watched.of_mode(s.mode);
        const auto& flow = s.system.modes[s.mode].flow;
        march(s, [&](const auto& y, double span) {
            for (int i = 0; i < watched.count; ++i)
                include_step(of[i], detail::derivatives<taylor_order>(rows[i], y, flow),
                             span / unit_of_time(flow.step));
        });
    }
    VI_HD void write(const auto& m, const extremes& to) const {
        double* row = to.ranges.row(m.row);
        for (int k = 0; k < watched.count; ++k) {
            const bool seen = of[k].low <= of[k].high;
            row[2 * k] = seen ? of[k].low : not_a_number();
            row[2 * k + 1] = seen ? of[k].high : not_a_number();
        }
    }
};

} // namespace observe
} // namespace vi
