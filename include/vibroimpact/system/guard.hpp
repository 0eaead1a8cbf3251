// Guards: what ends a flight, and the one place where the sign convention is written.
//
// A guard reads u(t) = row . y(t) + gain between a lower and an upper limit. Its two gap functions
//
//     g = upper - u   (side +1, stop A)        g = u - lower   (side -1, stop B)
//
// are admissible where g >= 0. Impact: g falls to 0 with g' < 0. Grazing: g = g' = 0, g'' > 0.
// Sticking: g = g' = 0 and the free g'' <= 0. In a mode where the contact is closed the guard
// reads the contact force instead, lower = 0, and its fall to zero is the release.
//
// All time derivatives of u along a flight are rows too: u^(m) = rows[m] . y + gains[m], those beyond
// `plain_orders` in units of time: u^(m) unit^(m - plain_orders).
#pragma once

#include "vibroimpact/flow/modal.hpp"
#include "vibroimpact/numeric/math.hpp"
#if !defined(__CUDACC__) && !defined(__CUDACC_RTC__)
#include "vibroimpact/numeric/pack.hpp"
#endif

namespace vi {

inline constexpr double unit_roundoff = 0x1p-53;
inline constexpr int plain_orders = 7;
inline constexpr double proof_margin = 0x1p-30; // of terms: far above their rounding

enum side_of_guard { lower_side = -1, no_side = 0, upper_side = 1 };

// Whether any of some gains, of any lane, is or was not zero. Lanes are filled one by one, a double at once.
template <class R>
struct shift_flag {
    bool shifted = false;
};
template <>
struct shift_flag<double> {
    bool shifted;
};

// u at times to come, all at once: value k is the sum of rows[j][k] y_j + gains[k]. Value 0 is u'' h^2
// now, the others are u at the times of a grid, h apart.
template <class R, int Dimension>
struct rows_ahead : shift_flag<R> {
    static constexpr int count = grid_times + 1;
    vec<vec<R, count>, Dimension> rows;
    vec<R, count> gains;
};

template <class R, int Dimension, int Orders = taylor_order>
struct guard {
    vec<R, Dimension> rows[Orders + 1];
    R gains[Orders + 1];
    rows_ahead<R, Dimension> ahead[grids]; // of a modal flow
    // Numbers by which search/grid/grid_bounds.hpp bounds u. Of the share w of each block in u: sqrt(k) w''' and w'''',
    // what its a adds to them, and per |y_j| the terms of u within a step; what limits and lines add.
    vec<R, Dimension> third, fourth;
    vec<R, Dimension / 2> third_push, fourth_push;
    vec<R, Dimension> weights;
    R least_terms, least_fourth, least_sixth;
    // Of a flow without blocks, for what may happen within a step: the terms of u per largest |y_j|, |u''| per
    // largest |y_j| on the way, and what the constant adds to that.
    R spread, bend, push;
    R lower, upper; // infinite where there is no stop
    R reach;        // the largest finite |limit|
    R own_size;     // of u, as limits, lines and constant forces give it; in flows with blocks only
    int closed;     // side held in this mode, or no_side: then rows give the force, not the gap
};

// Numbers of the rows for bounds; the forcing lines, being (sin, omega cos), add the same always.
template <class R, int Dimension, int Orders, class Flow>
VI_HD inline void prepare_bounds(guard<R, Dimension, Orders>& g, const Flow& flow) {
    g.least_terms = g.reach;
    g.least_fourth = g.least_sixth = R(0.0);
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
        const R most = sqrt(w4 * w4 + w3 * w3);
        g.least_fourth = g.least_fourth + most;
        g.least_sixth = g.least_sixth + flow.k[j] * most;
        g.least_terms = g.least_terms + (g.weights[2 * j] + g.weights[2 * j + 1] * root);
    }
}

template <int Dimension, class Guard, class Flow>
VI_HD inline void set_rows_ahead(rows_ahead<double, Dimension>& to, const Guard& g,
                                 const Flow& flow, int grid) {
    const double h = flow.grid_step(grid), square = h * h;
    for (int j = 0; j < flow.dimension(); ++j)
        to.rows[j][0] = square * g.rows[2][j];
    to.gains[0] = square * g.gains[2];
    for (int k = 1; k <= grid_times; ++k) {
        const auto e = flow.whole(k * static_cast<int>(flow.spacing[grid]));
        const auto row = flow.row_before(e, g.rows[0]);
        for (int j = 0; j < flow.dimension(); ++j)
            to.rows[j][k] = row[j];
        to.gains[k] = flow.gain_before(e, g.rows[0]) + g.gains[0];
    }
    to.shifted = false;
    for (double gain : to.gains.x)
        to.shifted = to.shifted || gain != 0.0;
}

// The slack e/4 of (1) in search/grid/grid_bounds.hpp for the wide grid, as a part of half the clearance, where
// oscillators move as much as the forcing makes u move.
template <class R, int Dimension, int Orders, class Flow>
VI_HD inline R liveliness(const guard<R, Dimension, Orders>& g, const Flow& flow) {
    const R half = (g.upper - g.lower) / 2.0;
    R forced = R(0.0), fourth = R(0.0), squares = R(0.0);
    for (int j = 0; j < flow.blocks(); ++j) {
        const R r = g.rows[0][2 * j], s = g.rows[0][2 * j + 1], square = flow.k[j] * flow.k[j];
        const R size = sqrt(r * r + flow.k[j] * (s * s));
        if (j < flow.oscillators()) {
            if (r != 0.0 || s != 0.0) squares = squares + square;
        } else {
            forced = forced + size;
            fourth = fourth + square * size;
        }
    }
    const R room = half < infinity() ? half : max(forced, g.reach);
    if (!(room > 0.0)) return flow.grid_error[wide_grid] * squares;
    const R moved = forced > 0.0 ? min(forced, room) : room;
    return flow.grid_error[wide_grid] * (fourth + squares * moved) / room;
}

// Numbers that the quick flight reads.
template <class R, int Dimension, int Orders, class Flow>
VI_HD inline void prepare_quick(guard<R, Dimension, Orders>& g, const Flow& flow) {
    for (int grid = 0; grid < grids; ++grid)
        set_rows_ahead(g.ahead[grid], g, flow, grid);
    prepare_bounds(g, flow);
}

// Fill rows 1, 2, ... from row 0.
template <class R, int Dimension, int Orders, class Flow>
VI_HD inline void differentiate(guard<R, Dimension, Orders>& g, const Flow& flow) {
    const double unit = unit_of_time(flow.step);
    for (int m = 0; m < Orders; ++m) {
        g.rows[m + 1] = flow.next_row(g.rows[m]);
        g.gains[m + 1] = flow.row_gain(g.rows[m]);
        if (m < plain_orders) continue;
        g.gains[m + 1] = unit * g.gains[m + 1];
        for (int j = 0; j < flow.dimension(); ++j)
            g.rows[m + 1][j] = unit * g.rows[m + 1][j];
    }
}

// The size that limits, lines and constant forces, within a step, give to u.
template <int Dimension, class Flow>
VI_HD inline void set_own_size(guard<double, Dimension>& g, const Flow& flow) {
    g.own_size = g.reach + abs(g.gains[0]);
    for (int j = 0; j < flow.blocks(); ++j) {
        const bool turns = j >= flow.oscillators(); // a line: at most one
        const double rate = turns ? sqrt(flow.k[j]) : abs(flow.a[j]) * flow.step;
        const double way = turns ? 1.0 : rate * flow.step;
        g.own_size = g.own_size + (abs(g.rows[0][2 * j]) * way + abs(g.rows[0][2 * j + 1]) * rate);
    }
}

// The terms that add up to a derivative of u within a step: those of the motion per largest |y_j|, and the others.
struct terms_of_derivative {
    double per_largest = 0.0, adds;

    terms_of_derivative() = default;
    template <class R, int Dimension, int Orders, class Flow>
    VI_HD terms_of_derivative(const guard<R, Dimension, Orders>& g, int m, const Flow& flow)
        : adds(abs(g.gains[m]) + flow.step * abs(g.gains[m + 1])) {
        for (int j = 0; j < flow.dimension(); ++j)
            per_largest = per_largest + (abs(g.rows[m][j]) + flow.step * abs(g.rows[m + 1][j]));
    }
};

// Fills what stays_out_of_reach reads; infinite where that does not hold.
template <int Dimension, class Flow>
VI_HD inline void prepare_reach(guard<double, Dimension>& g, const Flow& flow) {
    const int n = flow.dimension(), first = n - 2 * flow.lines();
    double norm = 0.0, largest = 0.0;
    g.bend = 0.0;
    g.spread = terms_of_derivative(g, 0, flow).per_largest;
    for (int i = 0; i < n; ++i) {
        double row = 0.0, push = abs(flow.constant[i]); // lines are at most one
        for (int j = 0; j < n; ++j) {
            double& sum = i < first && j >= first ? push : row;
            sum = sum + abs(flow.b[i][j]);
        }
        norm = max(norm, row);
        largest = max(largest, push);
        g.bend = g.bend + abs(g.rows[2][i]);
    }
    g.push = flow.step * largest;
    const double turned = norm * flow.step; // the state grows by exp of it within a step, at most
    const double growth = turned <= 0.71 ? 2.04 : turned <= 1.42 ? 4.14 : infinity();
    g.bend = growth * g.bend;
}

// Whether u stays off its limits for a time, a step at most, by |u(s) - u| <= |u'| s + s^2/2 max |u''|, beyond
// rounding of 2^20 applications: at a tenth of the cost of all derivatives.
template <class T, int Dimension, class Flow>
VI_HD inline bool stays_out_of_reach(const guard<double, Dimension>& g, const vec<T, Dimension>& y,
                                     double span, const Flow& flow) {
    const int n = flow.dimension();
    double u = g.gains[0], rate = g.gains[1], largest = 0.0;
    for (int i = 0; i < n; ++i) {
        const double x = plain(y[i]);
        u = u + g.rows[0][i] * x;
        rate = rate + g.rows[1][i] * x;
        largest = max(largest, abs(x));
    }
    const double bend = g.bend * (largest + g.push) + abs(g.gains[2]);
    const double way = span * (abs(rate) + 0.5 * span * bend);
    const double needed = way + proof_margin * (g.spread * largest + abs(g.gains[0]) + g.reach);
    return g.upper - u > needed && u - g.lower > needed;
}
inline constexpr double most_out_of_reach = 0x1p20; // applications

// Rounding of u - limit, u being the sum of terms of this size.
VI_HD inline double rounding_at(double limit, double terms) {
    return 64.0 * unit_roundoff * (terms + abs(limit));
}

// Rounding of u after so many applications of a propagator, whose errors add up.
VI_HD inline double rounding_after(double applications, double terms) {
    return unit_roundoff * (16.0 + 4.0 * applications) * terms;
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

namespace detail {

// Its values only, and zeros beyond.
template <class T, int D>
VI_HD inline vec<double, D> plain_state(const vec<T, D>& y, int n) {
    vec<double, D> z{};
    for (int i = 0; i < n; ++i)
        z[i] = plain(y[i]);
    return z;
}

} // namespace detail

// u^(m) at y, m up to plain_orders.
template <class T, class R, int Dimension, int Orders>
VI_HOT T guard_value(const guard<R, Dimension, Orders>& g, int m, const vec<T, Dimension>& y,
                     int n) {
    return dot(g.rows[m], y, n, g.gains[m]);
}

// u at y, a state of a modal flow; being a distance, it shows q' of oscillators in mixed ones only.
template <class T, class G, int Dimension, class Flow>
VI_HOT T guard_distance(const G& g, const vec<T, Dimension>& y, const Flow& flow) {
    T sum = T(g.gains[0]);
    flow.each_oscillator([&](auto j) VI_WITHIN {
        sum = fma(g.rows[0][2 * j], y[2 * j], sum);
        if (flow.mixed()) sum = fma(g.rows[0][2 * j + 1], y[2 * j + 1], sum);
    });
    flow.each_line([&](auto j) VI_WITHIN {
        sum = fma(g.rows[0][2 * j + 1], y[2 * j + 1], fma(g.rows[0][2 * j], y[2 * j], sum));
    });
    return sum;
}
// u'. What rows[0] has before q, rows[1] has before q', unless the flow is mixed.
template <class T, class R, int Dimension, int Orders, class Flow>
VI_HOT T guard_speed(const guard<R, Dimension, Orders>& g, const vec<T, Dimension>& y,
                     const Flow& flow) {
    T sum = flow.mixed() ? T(g.gains[1]) : T(0.0);
    flow.each_oscillator([&](auto j) VI_WITHIN {
        if (flow.mixed())
            sum = fma(g.rows[1][2 * j + 1], y[2 * j + 1], fma(g.rows[1][2 * j], y[2 * j], sum));
        else
            sum = fma(g.rows[0][2 * j], y[2 * j + 1], sum);
    });
    flow.each_line([&](auto j) VI_WITHIN {
        sum = fma(g.rows[0][2 * j], y[2 * j + 1], fma(g.rows[1][2 * j], y[2 * j], sum));
    });
    return sum;
}

// u, u', u''/2 and u'''/6: what u shows of q, u'' shows of q''.
template <class T, class R, int Dimension, int Orders, class Flow>
VI_HOT vec<T, 4> expand(const guard<R, Dimension, Orders>& g, const vec<T, Dimension>& y,
                        const Flow& flow) {
    T u = T(g.gains[0]), slope = T(0.0), bend = T(0.0), twist = T(0.0);
    flow.each_oscillator([&](auto j) VI_WITHIN {
        const T &q = y[2 * j], &v = y[2 * j + 1];
        const R &row = g.rows[0][2 * j], &also = g.rows[0][2 * j + 1];
        u = fma(row, q, u);
        slope = fma(row, v, slope);
        if (flow.mixed()) u = fma(also, v, u);
        if (flow.template drifts<T>(j)) return;
        const T rate = flow.pull(j, q, v);
        const T change = fma(flow.c[j], rate, flow.k[j] * v); // -q'''
        bend = fma(row, rate, bend);
        twist = fnma(row, change, twist);
        if (!flow.mixed()) return;
        slope = fma(also, rate, slope);
        bend = fnma(also, change, bend);
        twist = fma(also, fnma(flow.k[j], rate, flow.c[j] * change), twist);
    });
    flow.each_line([&](auto j) VI_WITHIN { // q'' = -k q
        const T &q = y[2 * j], &v = y[2 * j + 1];
        const T share = fma(g.rows[0][2 * j + 1], v, g.rows[0][2 * j] * q);
        const T change = fma(g.rows[0][2 * j], v, g.rows[1][2 * j] * q);
        u = u + share;
        slope = slope + change;
        bend = fnma(flow.k[j], share, bend);
        twist = fnma(flow.k[j], change, twist);
    });
    return {u, slope, 0.5 * bend, (1.0 / 6) * twist};
}

// u''.
template <class T, class R, int Dimension, int Orders, class Flow>
VI_HOT T guard_bend(const guard<R, Dimension, Orders>& g, const vec<T, Dimension>& y,
                    const Flow& flow) {
    T sum = T(0.0);
    flow.each_oscillator([&](auto j) VI_WITHIN {
        if (flow.template drifts<T>(j)) return;
        const T &q = y[2 * j], &v = y[2 * j + 1];
        const T rate = flow.pull(j, q, v);
        sum = fma(g.rows[0][2 * j], rate, sum);
        if (!flow.mixed()) return;
        sum = fnma(g.rows[0][2 * j + 1], fma(flow.c[j], rate, flow.k[j] * v), sum); // q'''
    });
    flow.each_line([&](auto j) VI_WITHIN { // q'' = -k q
        const T share = fma(g.rows[0][2 * j + 1], y[2 * j + 1], g.rows[0][2 * j] * y[2 * j]);
        sum = fnma(flow.k[j], share, sum);
    });
    return sum;
}

// u along a grid, value by value: u'' h^2 at y, then u at the times of the grid.
template <class T, class R, int Dimension, class Flow>
VI_HOT void guard_ahead(const rows_ahead<R, Dimension>& p, const vec<T, Dimension>& y,
                        const Flow& flow, vec<T, grid_times + 1>& to) {
    constexpr int count = grid_times + 1;
    unrolled<0, count>([&](auto k) VI_WITHIN { to[k] = T(0.0); });
    if (p.shifted) unrolled<0, count>([&](auto k) VI_WITHIN { to[k] = T(p.gains[k]); });
    const auto add = [&](auto j) VI_WITHIN {
        unrolled<0, count>([&](auto k) VI_WITHIN { to[k] = fma(p.rows[j][k], y[j], to[k]); });
    };
    flow.each_oscillator([&](auto j) VI_WITHIN {
        if (flow.template drifts<T>(j)) { // rows of u'' are zero, those of q all the same
            unrolled<1, count>([&](auto k) VI_WITHIN {
                to[k] =
                    fma(p.rows[2 * j + 1][k], y[2 * j + 1], fma(p.rows[2 * j][1], y[2 * j], to[k]));
            });
            return;
        }
        add(2 * j);
        add(2 * j + 1);
    });
    flow.each_line([&](auto j) VI_WITHIN {
        add(2 * j);
        add(2 * j + 1);
    });
}

#if !defined(__CUDACC__) && !defined(__CUDACC_RTC__)
// Those sums two at a time: GCC does not find this in the loop above where that is inlined.
template <int Dimension, class Flow>
VI_HOT void guard_ahead(const rows_ahead<double, Dimension>& p, const vec<double, Dimension>& y,
                        const Flow& flow, vec<double, grid_times + 1>& to) {
    constexpr int count = grid_times + 1;
    static_assert(count % 2 == 0);
    using pair = pack<2>;
    const auto at = [](const vec<double, count>& row, int k) {
        pair both;
        __builtin_memcpy(&both.v, row.x + k, sizeof both.v);
        return both;
    };
    for (int k = 0; k < count; k += 2) {
        pair both = at(p.gains, k);
        flow.each_coordinate([&](auto j) { both = fma(at(p.rows[j], k), pair(y[j]), both); });
        __builtin_memcpy(to.x + k, &both.v, sizeof both.v);
    }
}
#endif

// Size of the terms that add up to u^(m), over one step: what rounding errors are relative to. A flow
// that is not modal mixes coordinates, and leaves the rounding of the largest in all.
template <class T, class R, int Dimension, int Orders, class Flow>
VI_HD inline real_t<T> magnitude(const guard<R, Dimension, Orders>& g, int m,
                                 const vec<T, Dimension>& y, const Flow& flow) {
    const int n = flow.dimension();
    real_t<T> largest = real_t<T>(0.0), sum = real_t<T>(0.0);
    if constexpr (!is_modal<Flow>)
        for (int i = 0; i < n; ++i)
            largest = max(largest, abs(value(y[i])));
    for (int i = 0; i < n; ++i) {
        const real_t<T> x = is_modal<Flow> ? value(y[i]) : largest;
        sum = sum + abs(g.rows[m][i] * x) + flow.step * abs(g.rows[m + 1][i] * x);
    }
    return sum;
}

} // namespace vi
