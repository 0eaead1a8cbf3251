// Guards: what ends a flight, and the one place where the sign convention is written.
//
// A guard watches u(t) = row . y(t) + gain between a lower and an upper limit. Its two gap functions
//
//     g = upper - u   (side +1, stop A)        g = u - lower   (side -1, stop B)
//
// are admissible where g >= 0. Impact: g falls to 0 with g' < 0. Grazing: g = g' = 0, g'' > 0.
// Sticking: g = g' = 0 and the free g'' <= 0. In a mode where the contact is closed the guard
// watches the contact force instead, lower = 0, and its fall to zero is the release.
//
// All time derivatives of u along a flight are rows too: u^(m) = rows[m] . y + gains[m].
#pragma once

#include "vibroimpact/flow/modal.hpp"
#include "vibroimpact/math.hpp"
#if !defined(__CUDACC__) && !defined(__CUDACC_RTC__)
#include "vibroimpact/scalar/pack.hpp"
#endif

namespace vi {

inline constexpr double unit_roundoff = 0x1p-53;

enum side_of_guard { lower_side = -1, no_side = 0, upper_side = 1 };

// Several affine functions of y at once: value k is the sum of rows[j][k] y_j + gains[k].
template <class R, int Dimension, int Count>
struct affine_rows {
    vec<vec<R, Count>, Dimension> rows;
    vec<R, Count> gains;
};

template <class R, int Dimension, int Orders = taylor_order>
struct guard {
    vec<R, Dimension> rows[Orders + 1];
    R gains[Orders + 1];
    // Of a modal flow and a grid of times h apart: u'' h^2 now, then u at these times.
    affine_rows<R, Dimension, grid_times + 1> ahead[grids];
    affine_rows<R, Dimension, 2> bending; // u''/2 and u'''/6
    // What event/lookahead.hpp bounds with. Of the share w of each block in u: sqrt(k) w''' and w'''',
    // what its a adds to them, and per |y_j| the terms of u within a step; what limits and lines add.
    vec<R, Dimension> third, fourth;
    vec<R, Dimension / 2> third_push, fourth_push;
    vec<R, Dimension> weights;
    R least_terms, least_fourth;
    R lower, upper; // infinite where there is no stop
    R reach;        // the largest finite |limit|
    int closed;     // side held in this mode, or no_side: then rows give the force, not the gap
};

// What bounds need of the rows; the forcing lines, being (sin, omega cos), add the same always.
template <class R, int Dimension, int Orders, class Flow>
VI_HD inline void prepare_bounds(guard<R, Dimension, Orders>& g, const Flow& flow) {
    g.least_terms = g.reach;
    g.least_fourth = R(0.0);
    for (int j = 0; j < flow.blocks(); ++j) {
        const R root = sqrt(flow.k[j]);
        for (int i = 2 * j; i < 2 * j + 2; ++i) {
            g.weights[i] = abs(g.rows[0][i]) + flow.step * abs(g.rows[1][i]);
            g.third[i] = root * g.rows[3][i];
            g.fourth[i] = g.rows[4][i];
        }
        g.third_push[j] = root * (g.rows[2][2 * j + 1] * flow.a[j]);
        g.fourth_push[j] = g.rows[3][2 * j + 1] * flow.a[j];
        if (j < flow.oscillators()) continue;
        const R w3 = g.third[2 * j], w4 = g.fourth[2 * j]; // at theta = pi / 2
        g.least_fourth = g.least_fourth + sqrt(w4 * w4 + w3 * w3);
        g.least_terms = g.least_terms + (g.weights[2 * j] + g.weights[2 * j + 1] * root);
    }
}

// u'' h^2 and u at the times of a grid, as rows.
template <class Rows, class Guard, class Flow>
VI_HD inline void look_ahead(Rows& to, const Guard& g, const Flow& flow, int grid) {
    const double h = flow.grid_step(grid), square = h * h;
    for (int j = 0; j < flow.dimension(); ++j)
        to.rows[j][0] = square * g.rows[2][j];
    to.gains[0] = square * g.gains[2];
    for (int k = 1; k <= grid_times; ++k) {
        const auto e = flow.whole(k * grid_parts[grid]);
        const auto row = flow.row_before(e, g.rows[0]);
        for (int j = 0; j < flow.dimension(); ++j)
            to.rows[j][k] = row[j];
        to.gains[k] = flow.gain_before(e, g.rows[0]) + g.gains[0];
    }
}

// What the quick flight reads.
template <class R, int Dimension, int Orders, class Flow>
VI_HD inline void prepare_quick(guard<R, Dimension, Orders>& g, const Flow& flow) {
    for (int i = 0; i < grids; ++i)
        look_ahead(g.ahead[i], g, flow, i);
    for (int j = 0; j < flow.dimension(); ++j) {
        g.bending.rows[j][0] = g.rows[2][j] / 2.0;
        g.bending.rows[j][1] = g.rows[3][j] / 6.0;
    }
    g.bending.gains[0] = g.gains[2] / 2.0;
    g.bending.gains[1] = g.gains[3] / 6.0;
    prepare_bounds(g, flow);
}

// Fill rows 1, 2, ... and what lies ahead from row 0.
template <class R, int Dimension, int Orders, class Flow>
VI_HD inline void differentiate(guard<R, Dimension, Orders>& g, const Flow& flow) {
    for (int m = 0; m < Orders; ++m) {
        g.rows[m + 1] = flow.next_row(g.rows[m]);
        g.gains[m + 1] = flow.row_gain(g.rows[m]);
    }
    if constexpr (is_modal<Flow>) prepare_quick(g, flow);
}

// Rounding of u - limit, u being the sum of terms of this size.
VI_HD inline double rounding_at(double limit, double terms) {
    return 64.0 * unit_roundoff * (terms + abs(limit));
}

// The side on whose limit u lies within rounding, or 0.
template <class R, int Dimension, int Orders>
VI_HD constexpr double side_within(const guard<R, Dimension, Orders>& g, double u, double terms) {
    const auto on = [&](double limit) { // an infinite limit is never reached
        return abs(limit) < 0x1p1000 && abs(limit - u) <= rounding_at(limit, terms);
    };
    if (on(g.upper)) return upper_side;
    if (on(g.lower)) return lower_side;
    return 0.0;
}

// A state without its derivatives.
template <Real R, int D>
VI_HD inline const vec<R, D>& values_of(const vec<R, D>& y, int) {
    return y; // NOLINT(bugprone-return-const-ref-from-parameter): only named states are passed
}
template <class T, int D>
VI_HD inline vec<real_t<T>, D> values_of(const vec<T, D>& y, int n) {
    vec<real_t<T>, D> out{};
    for (int i = 0; i < n; ++i)
        out[i] = value(y[i]);
    return out;
}

// u^(m) at y.
template <class T, class R, int Dimension, int Orders>
VI_HOT T watch(const guard<R, Dimension, Orders>& g, int m, const vec<T, Dimension>& y, int n) {
    return dot(g.rows[m], y, n, g.gains[m]);
}

// The forcing lines of a row, on top of a sum.
template <class T, class R, int Dimension, class Flow>
VI_HOT T add_lines(const vec<R, Dimension>& row, const vec<T, Dimension>& y, const Flow& flow,
                   T sum) {
    flow.each_line([&](auto j) VI_WITHIN {
        sum = fma(row[2 * j + 1], y[2 * j + 1], fma(row[2 * j], y[2 * j], sum));
    });
    return sum;
}

// u and u' at y, a state of a modal flow; u is a distance, so oscillators show as positions alone.
template <class T, class R, int Dimension, int Orders, class Flow>
VI_HOT T watch_distance(const guard<R, Dimension, Orders>& g, const vec<T, Dimension>& y,
                        const Flow& flow) {
    T sum = T(g.gains[0]);
    flow.each_oscillator([&](auto j) VI_WITHIN { sum = fma(g.rows[0][2 * j], y[2 * j], sum); });
    return add_lines(g.rows[0], y, flow, sum);
}
template <class T, class R, int Dimension, int Orders, class Flow>
VI_HOT T watch_speed(const guard<R, Dimension, Orders>& g, const vec<T, Dimension>& y,
                     const Flow& flow) {
    T sum = T(0.0);
    flow.each_oscillator([&](auto j)
                             VI_WITHIN { sum = fma(g.rows[1][2 * j + 1], y[2 * j + 1], sum); });
    return add_lines(g.rows[1], y, flow, sum);
}

// u''/2 and u'''/6.
template <class T, class R, int Dimension, int Orders, class Flow>
VI_HOT vec<T, 2> watch_bending(const guard<R, Dimension, Orders>& g, const vec<T, Dimension>& y,
                               const Flow& flow) {
    T half = T(g.bending.gains[0]), sixth = T(g.bending.gains[1]);
    const auto add = [&](int i) VI_WITHIN {
        half = fma(g.bending.rows[i][0], y[i], half);
        sixth = fma(g.bending.rows[i][1], y[i], sixth);
    };
    flow.each_oscillator([&](auto j) VI_WITHIN {
        if (flow.template drifts<T>(j)) return;
        add(2 * j);
        add(2 * j + 1);
    });
    flow.each_line([&](auto j) VI_WITHIN {
        add(2 * j);
        add(2 * j + 1);
    });
    return {half, sixth};
}

// All of several affine functions at y.
template <class T, class R, int Dimension, int Count, class Shape>
VI_HOT vec<T, Count> watch_all(const affine_rows<R, Dimension, Count>& p,
                               const vec<T, Dimension>& y, const sizes<Shape>& size) {
    vec<T, Count> sum;
    unrolled<0, Count>([&](auto k) {
        T one = T(p.gains[k]);
        size.each_coordinate([&](auto j) { one = fma(p.rows[j][k], y[j], one); });
        sum[k] = one;
    });
    return sum;
}

#if !defined(__CUDACC__) && !defined(__CUDACC_RTC__)
// The same sums, two at a time: GCC does not find this in the loop above where that is inlined.
template <int Dimension, int Count, class Shape>
VI_HOT vec<double, Count> watch_all(const affine_rows<double, Dimension, Count>& p,
                                    const vec<double, Dimension>& y, const sizes<Shape>& size) {
    static_assert(Count % 2 == 0);
    using pair = pack<2>;
    const auto at = [](const vec<double, Count>& row, int k) {
        pair both;
        __builtin_memcpy(&both.v, row.x + k, sizeof both.v);
        return both;
    };
    vec<double, Count> sum;
    for (int k = 0; k < Count; k += 2) {
        pair both = at(p.gains, k);
        size.each_coordinate([&](auto j) { both = fma(at(p.rows[j], k), pair(y[j]), both); });
        __builtin_memcpy(sum.x + k, &both.v, sizeof both.v);
    }
    return sum;
}
#endif

// Size of the terms that add up to u^(m), over one step: what rounding errors are relative to.
template <class T, class R, int Dimension, int Orders>
VI_HD inline real_t<T> magnitude(const guard<R, Dimension, Orders>& g, int m,
                                 const vec<T, Dimension>& y, int n, R step) {
    real_t<T> sum = real_t<T>(0.0);
    for (int i = 0; i < n; ++i) {
        const real_t<T> x = value(y[i]);
        sum = sum + abs(g.rows[m][i] * x) + step * abs(g.rows[m + 1][i] * x);
    }
    return sum;
}

} // namespace vi
