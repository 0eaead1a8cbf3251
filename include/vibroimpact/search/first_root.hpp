// The first root of a gap function in a window, found or excluded.
//
// Method      The window [0, S] is cut into pieces until each is one of these         (theory T17)
//               excluded  g >= min(g(0), g(L)) - L^2/8 max|g''| > eps               (1)
//               convex    g'' >= 0: one minimum, at an end or where g' = 0          (2)
//               concave   g'' <= 0: a root in (0, L] if and only if g(L) <= 0       (3)
//               monotone  |g'(0)| > L max|g''|: g' keeps its sign                   (4)
//             with g'' within g''(0) + g'''(0) s -/+ M4 s^2/2, extreme at the ends.
//             An interior minimum is located and decided by its value:
//               above eps no contact, below -eps contact before it, within eps grazing.
//             Pieces are taken from left to right, so the root returned is the first. A flight
//             that bounces off the stop begins with a piece just longer than its bounce; one that leaves
//             it with more than three zeros, with one in which the first term is the largest.
// Assumes     g(0) >= 0 up to eps. A flight that leaves this very stop passes leaving = true and
//             exact zeros in d_0 (and d_1, d_2 where they vanish): t = 0 is then not a root.
// Accuracy    outside eps every extremum is decided as it is; the root itself to a few ulp of s,
//             or eps / |g'|
// Fails       grazing also where a piece of 2^-24 of the window, of 2^-60 next to the stop that is left,
//             is still undecided and |g| <= eps: g, g' and g'' vanish together; undecided where
//             |g| > eps there (never observed).
#pragma once

#include "vibroimpact/search/polynomial.hpp"

namespace vi {

enum class finding { none, root, grazing, undecided };

struct window_verdict {
    finding what;
    double s; // where, measured from the left end of the window
};

namespace detail {

enum class piece { excluded, cut, root, grazing };
struct piece_verdict {
    piece what;
    double s;
};

// g' rises through zero inside (0, length): decide the minimum by its value.
template <int N>
VI_HD inline piece_verdict decide_minimum(const taylor<N>& g, double length, double eps) {
    const double at = sign_change(g, 1, 0.0, length);
    const double depth = evaluate(g, 0, at);
    if (depth > eps) return {piece::excluded, 0.0};
    if (depth >= -eps) return {piece::grazing, at};
    return {piece::root, sign_change(g, 0, 0.0, at)};
}

template <int N>
VI_HD inline piece_verdict falling_to(const taylor<N>& g, double length) {
    if (evaluate(g, 0, length) > 0.0) return {piece::excluded, 0.0};
    if (g.d[0] == 0.0 && g.d[1] > 0.0) // leaving and concave: g(s)/s falls through the same root
        return {piece::root, sign_change(without_zero(g), 0, 0.0, length)};
    return {piece::root, sign_change(g, 0, 0.0, length)};
}

template <int N>
VI_HD inline piece_verdict classify(const taylor<N>& g, double length, double eps, bool leaving) {
    const double m4 = fourth_derivative_bound(g, length);
    const double bend = g.d[2] + g.d[3] * length;
    const double spread = m4 * length * length / 2.0;
    const double low = min(g.d[2], bend - spread), high = max(g.d[2], bend + spread);
    const double steepest = max(abs(low), abs(high));
    const double end = evaluate(g, 0, length);

    if (min(g.d[0], end) - steepest * length * length / 8.0 > eps) // (1)
        return {piece::excluded, 0.0};
    const bool close = !leaving && g.d[0] <= eps; // on the stop without having left it
    if (low >= 0.0) {                             // (2)
        if (g.d[1] >= 0.0) return {close ? piece::grazing : piece::excluded, 0.0};
        if (evaluate(g, 1, length) < 0.0) return falling_to(g, length);
        return decide_minimum(g, length, eps);
    }
    if (g.d[1] > steepest * length) // (4), rising
        return {close ? piece::grazing : piece::excluded, 0.0};
    if (high <= 0.0 || g.d[1] < -steepest * length) return falling_to(g, length); // (3), (4)
    return {piece::cut, 0.0};
}

// A quarter beyond the return of a bounce, g = rate s + bend s^2 / 2.
VI_HD inline double beyond_bounce(double rate, double bend) {
    return rate > 0.0 && bend < 0.0 ? 1.25 * (-2.0 * rate / bend) : infinity();
}

// Length of the first piece; a bounce too short for the halvings that are left does not count.
template <int N>
VI_HD inline double first_piece(const taylor<N>& g, double span) {
    if (g.d[0] != 0.0) return span;
    const double beyond = beyond_bounce(g.d[1], g.d[2]);
    return beyond < span && beyond > span * 0x1p-20 ? beyond : span;
}

// A start with more zeros than (2) sees, g = g' = g'' = g''' = 0: up to here the first derivative that is
// not zero, positive, outweighs all that follow twice. 0 where there are fewer zeros.
template <int N>
VI_HD inline double flat_stretch(const taylor<N>& g, double span) {
    int zeros = 0;
    while (zeros < N && g.d[zeros] == 0.0)
        ++zeros;
    if (zeros <= 3 || zeros == N || !(g.d[zeros] > 0.0)) return 0.0;
    double rest = abs(g.d[N]); // |g^(zeros + 1)| is at most this
    for (int m = N - 1; m > zeros; --m)
        rest = abs(g.d[m]) + rest * (span * reciprocal[m - zeros]);
    return rest * span <= 0.5 * g.d[zeros] ? span : 0.5 * g.d[zeros] / rest;
}

} // namespace detail

template <int N>
VI_HD inline window_verdict first_root(taylor<N> g, double span, double eps, bool leaving) {
    double from = 0.0, length = detail::first_piece(g, span);
    if (const double flat = leaving ? detail::flat_stretch(g, span) : 0.0; flat > 0.0) {
        g = recentred(g, flat);
        from = flat;
        length = min(flat, span - from);
        leaving = g.d[0] <= eps;
    }
    while (from < span) {
        const auto verdict = detail::classify(g, length, eps, leaving);
        if (verdict.what == detail::piece::root) return {finding::root, from + verdict.s};
        if (verdict.what == detail::piece::grazing) return {finding::grazing, from + verdict.s};
        if (verdict.what == detail::piece::cut) {
            length = length / 2.0;
            if (length >= span * (leaving ? 0x1p-60 : 0x1p-24)) continue;
            return {abs(g.d[0]) <= eps ? finding::grazing : finding::undecided, from};
        }
        if (from + length >= span) break;
        g = recentred(g, length);
        from = from + length;
        length = min(2.0 * length, span - from);
        leaving = leaving && g.d[0] <= eps; // exact zeros keep small gaps exact: not back yet
    }
    return {finding::none, span};
}

} // namespace vi
