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

namespace vi {

inline constexpr double unit_roundoff = 0x1p-53;

enum side_of_guard { lower_side = -1, no_side = 0, upper_side = 1 };

template <class R, int Dimension, int Orders = taylor_order>
struct guard {
    vec<R, Dimension> rows[Orders + 1];
    R gains[Orders + 1];
    R lower, upper; // infinite where there is no stop
    R reach;        // the largest finite |limit|
    int closed;     // side held in this mode, or no_side: then rows give the force, not the gap
};

// Fill rows 1, 2, ... from row 0.
template <class R, int Dimension, int Orders, class Flow>
VI_HD inline void differentiate(guard<R, Dimension, Orders>& g, const Flow& flow) {
    for (int m = 0; m < Orders; ++m) {
        g.rows[m + 1] = flow.next_row(g.rows[m]);
        g.gains[m + 1] = flow.row_gain(g.rows[m]);
    }
}

// The side on whose limit u lies within rounding of its terms, or 0.
template <class R, int Dimension, int Orders>
VI_HD constexpr double side_within(const guard<R, Dimension, Orders>& g, double u, double terms) {
    const auto on = [&](double limit) { // an infinite limit is never reached
        return abs(limit) < 0x1p1000 &&
               abs(limit - u) <= 64.0 * unit_roundoff * (terms + abs(limit));
    };
    if (on(g.upper)) return upper_side;
    if (on(g.lower)) return lower_side;
    return 0.0;
}

// u^(m) at y.
template <class T, class R, int Dimension, int Orders>
VI_HD inline T watch(const guard<R, Dimension, Orders>& g, int m, const vec<T, Dimension>& y,
                     int n) {
    return dot(g.rows[m], y, n) + g.gains[m];
}

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
