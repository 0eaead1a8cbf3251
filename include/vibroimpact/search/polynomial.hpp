// Taylor polynomials of a gap function over one step, and bounds of their derivatives.
//
// Method      g(s) = sum over m <= N of d_m s^m / m!, 0 <= s <= S, in units of time. Since S is at most 7/10 of
//             the fastest rate, what is cut off at N = 18 is below (7/10)^19 / 19! < 2^-66 of the terms'
//             size, less than the rounding of the first term.
//             |g''''(s)| <= sum over m >= 4 of |d_m| S^(m-4) / (m-4)!                     (1)
// Reference   theory.md, "First contact"
#pragma once

#include "vibroimpact/flow/modal.hpp"
#include "vibroimpact/numeric/math.hpp"

namespace vi {

// 1/n for n = 0..18; the entry for 0 is never used.
inline constexpr double reciprocal[taylor_order + 1] = {
    0.0,      1.0,      1.0 / 2,  1.0 / 3,  1.0 / 4,  1.0 / 5,  1.0 / 6,
    1.0 / 7,  1.0 / 8,  1.0 / 9,  1.0 / 10, 1.0 / 11, 1.0 / 12, 1.0 / 13,
    1.0 / 14, 1.0 / 15, 1.0 / 16, 1.0 / 17, 1.0 / 18};

template <int N>
struct taylor {
    double d[N + 1]; // derivatives at s = 0
};
using taylor_polynomial = taylor<taylor_order>;

// g^(order)(s).
template <int N>
VI_HD inline double evaluate(const taylor<N>& g, int order, double s) {
    const double* d = g.d + order;
    double sum = d[N - order];
    for (int i = N - order - 1; i >= 0; --i)
        sum = fma(sum, s * reciprocal[i + 1], d[i]);
    return sum;
}

template <int N>
VI_HD inline taylor<N> recentred(const taylor<N>& g, double s) {
    taylor<N> out{};
    for (int m = 0; m <= N; ++m)
        out.d[m] = evaluate(g, m, s);
    return out;
}

// g(s)/s where d_0 = 0: short bounces keep their relative accuracy, and nothing underflows.
template <int N>
VI_HD inline taylor<N> without_zero(const taylor<N>& g) {
    taylor<N> out{};
    for (int m = 0; m < N; ++m)
        out.d[m] = g.d[m + 1] * reciprocal[m + 1];
    return out;
}

// (1)
template <int N>
VI_HD inline double fourth_derivative_bound(const taylor<N>& g, double span) {
    double sum = abs(g.d[N]);
    for (int m = N - 1; m >= 4; --m)
        sum = abs(g.d[m]) + sum * (span * reciprocal[m - 3]);
    return sum;
}

// |g(s) - g(0)| for 0 <= s <= span is at most this.
template <int N>
VI_HD inline double change_bound(const taylor<N>& g, double span) {
    double sum = abs(g.d[N]);
    for (int m = N - 1; m >= 1; --m)
        sum = fma(sum, span * reciprocal[m + 1], abs(g.d[m]));
    return sum * span;
}

// Newton's step towards a root far nearer to one end at least halves the bracket: so many halvings
// lead from the largest double to the smallest.
inline constexpr int most_halvings = 2200;

// Place between lo and hi where g^(order) changes sign: Newton kept inside a bracket, to rounding.
// The caller guarantees that g^(order) is monotone there and has different signs at the ends.
template <int N>
VI_HD inline double sign_change(const taylor<N>& g, int order, double lo, double hi) {
    const double start = lo;
    double s = hi, f = evaluate(g, order, hi);
    const bool falling = f <= 0.0;
    for (int i = 0; i < most_halvings; ++i) {
        if (f == 0.0) return s;
        if ((f > 0.0) == falling)
            lo = s;
        else
            hi = s;
        double next = s - f / evaluate(g, order + 1, s);
        if (next == s) return s;
        const bool known = next == hi || (next == lo && lo != start); // no root there
        if (known || !(next >= lo && next <= hi)) {
            next = lo + (hi - lo) / 2.0;
            if (next == lo || next == hi) return next;
        }
        s = next;
        f = evaluate(g, order, s);
    }
    return s;
}

} // namespace vi
