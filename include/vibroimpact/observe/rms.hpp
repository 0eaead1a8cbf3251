// Mean and mean square of u = row . (x, v, a) + gain over the window, flights included.
//
// Method      Gauss-Legendre quadrature with 7 nodes in every step, at which u is a Taylor
//             polynomial (search/polynomial.hpp)
// Accuracy    The integrand u^2 has rates up to 2 w, w the fastest rate of the system, and a step is
//             at most 0.7 / w: the remainder of 7 nodes on a step of length h is
//                 h (7!)^4 / (15 (14!)^3) (2 w h)^14 |u|^2 < 8 10^-18 h |u|^2
//             below the rounding 2^-53 of u^2 itself; sums add one rounding per step.
// Reference   Abramowitz, Stegun, Handbook of Mathematical Functions, 25.4.30
#pragma once

#include "vibroimpact/observe/observer.hpp"

namespace vi {

// Nodes in [-1, 1] and weights; the others are mirror images.
struct gauss_node {
    double x, weight;
};
inline constexpr gauss_node gauss_centre = {0.0, 0.41795918367346938776};
inline constexpr gauss_node gauss_pairs[3] = {{0.40584515137739716691, 0.38183005050511894495},
                                              {0.74153118559939443986, 0.27970539148927666790},
                                              {0.94910791234275852453, 0.12948496616886969327}};

// add(t, weight) for every node in [0, span], with weights that add up to 2.
template <class Add>
VI_HD inline void each_node(double span, const Add& add) {
    const double half = span / 2.0;
    add(half + half * gauss_centre.x, gauss_centre.weight);
    for (const auto& g : gauss_pairs) {
        add(half + half * -g.x, g.weight);
        add(half + half * g.x, g.weight);
    }
}

struct integrals {
    double first = 0.0, second = 0.0; // of u and u^2

    // Of u in a unit of time, over a span.
    VI_HD void include(const taylor_polynomial& u, double span, double unit) {
        double sum = 0.0, squares = 0.0;
        each_node(span / unit, [&](double t, double weight) {
            const double value = evaluate(u, 0, t);
            sum = sum + weight * value;
            squares = squares + weight * (value * value);
        });
        first = first + span / 2.0 * sum;
        second = second + span / 2.0 * squares;
    }
};

namespace observe {

struct rms {
    static constexpr const char* name = "rms";
    static constexpr int most_rows = 16;
    row_list rows{};
    result_table averages{}; // mean and root mean square of every row

    void options(const auto& to) { to.rows("rows", rows, most_rows); }
    void tables(const batch_sizes&, const auto& to) { to("averages", averages, 2 * rows.count); }
    template <class Flow>
    struct observer;
};

template <class Flow>
struct rms::observer {
    watched_rows<Flow> watched{};
    integrals of[most_rows];

    VI_HD void on_flight(const flight_segment<Flow>& s) {
        const auto* rows = watched.of_mode(s.mode);
        const auto& flow = s.system.modes[s.mode].flow;
        march(s, [&](const auto& y, double span) {
            for (int i = 0; i < watched.count; ++i)
                of[i].include(detail::derivatives<taylor_order>(rows[i], y, flow), span,
                              unit_of_time(flow.step));
        });
    }
    VI_HD void write(const auto& m, const rms& to) const {
        double* row = to.averages.row(m.row);
        for (int k = 0; k < watched.count; ++k) {
            row[2 * k] = of[k].first / m.duration;
            row[2 * k + 1] = sqrt(of[k].second / m.duration);
        }
    }
};

} // namespace observe
} // namespace vi
