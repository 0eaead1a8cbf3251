// What the look along the wide grid reads: in single precision, as it decides with a margin.
//
// Method      search/grid/grid_bounds.hpp, with rows, bounds and limits rounded. Let T be at least the sum of the
//             terms of u, of what corners and inner points are made of, and of e/4. In units of 2^-24 T
//             a sum of n products of rounded factors errs by less than n + 3, a corner by 9/4 (n + 3) + 8,
//             an inner point by 4/3 (n + 3) + 8, e/4 by n + 5: all together by less than half of a
//             margin of 13/2 n + 46. The other half is that of a limit up to 9 T; larger ones are not
//             reached.
//             L is the single precision of one system, or of those in the lanes of two packs.
// Accuracy    a crossing is proved with that margin; its place is a guess, landed on in double
// Fails       leaves to the narrow grid what is closer; everything, where numbers are so large or small
//             that products might leave the range of single precision
// Reference   theory.md, "First contact"
#pragma once

#include "vibroimpact/search/guard.hpp"

namespace vi {

VI_HD constexpr double wide_margin(int n) {
    return 0x1p-24 * (6.5 * n + 46.0);
}
// Weights that are not zero lie between 2^-60 and 2^60. What is smaller than 2^-126 is rounded by up to
// 2^-150; so much, weighed, of all terms is far below the margin of the floor.
inline constexpr double wide_range = 0x1p60, wide_floor = 0x1p-64;

// A guard as this look sees it. With third, fourth, pushes and least_fourth it bounds e/4 where a guard
// bounds M; with weights and least_terms it has the margin where a guard has the terms.
template <class L, int D>
struct wide_guard {
    vec<L, D> rows[1];
    L gains[1];
    rows_ahead<L, D> ahead;
    vec<L, D> third, fourth;
    vec<L, D / 2> third_push, fourth_push;
    vec<L, D> weights;
    L least_terms, least_fourth;
    L lower, upper;
};

// What it knows of the free mode, of one system or of those in lanes.
template <class L, class Shape>
struct wide_view : sizes<Shape> {
    static constexpr int D = Shape::max_dimension, K = Shape::max_contacts;
    static_assert(D <= 32); // the margin leaves out products of rounding errors

    bool pushed = false;    // as modal_flow says
    bool bends[D / 2] = {}; // likewise
    L spacing;
    wide_guard<L, D> guards[K];

    template <class T>
    VI_HOT constexpr bool drifts(int j) const {
        return !bends[j];
    }
};

namespace detail {

// T of one coordinate, per |y_j|: its largest term along the grid, and in the bounds.
template <int D, class G>
VI_HD inline double wide_weight(const rows_ahead<double, D>& ahead, const G& g, int j,
                                double error) {
    double most = abs(g.rows[0][j]);
    for (double row : ahead.rows[j].x)
        most = max(most, abs(row));
    return most + error * (abs(g.third[j]) + abs(g.fourth[j]));
}

template <int D, class G>
VI_HD inline void round_rows(wide_guard<floats<1>, D>& to, const rows_ahead<double, D>& ahead,
                             const G& g, int n) {
    for (int k = 0; k < ahead.count; ++k) {
        for (int j = 0; j < n; ++j)
            to.ahead.rows[j][k] = ahead.rows[j][k];
        to.ahead.gains[k] = ahead.gains[k];
    }
    to.ahead.shifted = ahead.shifted;
    for (int j = 0; j < n; ++j)
        to.rows[0][j] = g.rows[0][j];
    to.gains[0] = g.gains[0];
    to.lower = g.lower;
    to.upper = g.upper;
}

// e/4, `error` being that of M = 1.
template <int D, class G>
VI_HD inline void round_bounds(wide_guard<floats<1>, D>& to, const G& g, int n, double error) {
    for (int j = 0; j < n; ++j) {
        to.third[j] = error * g.third[j];
        to.fourth[j] = error * g.fourth[j];
    }
    for (int j = 0; j < n / 2; ++j) {
        to.third_push[j] = error * g.third_push[j];
        to.fourth_push[j] = error * g.fourth_push[j];
    }
    to.least_fourth = error * g.least_fourth;
}

// T of what does not depend on the state.
template <int D, class G, class Flow>
VI_HD inline double constant_terms(const rows_ahead<double, D>& ahead, const G& g, const Flow& flow,
                                   double error) {
    double gain = abs(g.gains[0]);
    for (double x : ahead.gains.x)
        gain = max(gain, abs(x));
    double terms = wide_floor + gain + error * g.least_fourth;
    for (int j = 0; j < flow.oscillators(); ++j)
        terms = terms + error * (abs(g.third_push[j]) + abs(g.fourth_push[j]));
    return terms;
}

template <int D, class G, class Flow>
VI_HD inline void prepare_wide(wide_guard<floats<1>, D>& to, const G& g, const Flow& flow) {
    const int n = flow.dimension();
    const double error = flow.grid_error[wide_grid], margin = wide_margin(n);
    rows_ahead<double, D> ahead;
    look_ahead(ahead, g, flow, wide_grid);
    round_rows(to, ahead, g, n);
    round_bounds(to, g, n, error);
    double terms = constant_terms(ahead, g, flow, error);
    bool fits = true;
    for (int j = 0; j < n; ++j) {
        const double weight = wide_weight(ahead, g, j, error);
        fits = fits && (weight == 0.0 || (weight >= 1.0 / wide_range && weight <= wide_range));
        to.weights[j] = margin * weight;
        if (j >= 2 * flow.oscillators()) // (sin, omega cos)
            terms = terms + weight * (j % 2 == 0 ? 1.0 : sqrt(flow.k[j / 2]));
    }
    to.least_terms = fits ? margin * terms : infinity();
}

} // namespace detail

template <class Shape, class Guards, class Flow>
VI_HD inline void prepare_wide(wide_view<floats<1>, Shape>& to, const Guards& guards,
                               const Flow& flow) {
    static_cast<sizes<Shape>&>(to) = flow;
    to.pushed = flow.pushed;
    for (int j = 0; j < flow.blocks(); ++j)
        to.bends[j] = flow.bends[j];
    to.spacing = flow.spacing[wide_grid];
    for (int i = 0; i < flow.contacts(); ++i)
        detail::prepare_wide(to.guards[i], guards[i], flow);
}

} // namespace vi
