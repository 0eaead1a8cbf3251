// How far u can get in a while, by what the blocks of a modal flow can add up to.
//
// Method      A block's share of u = row . y + gain, w = r q + s q', has (w - r a / k)^2 + w'^2 / k not
//             growing where k > 0, c >= 0 (theory T16e): it stays within the root of that around its
//             rest.                                                                      (1)
//             Where k = 0, q' goes no further from 0 than by |a| t: the share follows r q' t one way,
//             and is off by (|r| t + |s|) |a| t + |s q'| at most.                        (2)
//             Where k = 0, q' tends to a / c if c > 0, and q' = v + a t if c = 0: in the end the share
//             is straight, or a parabola, but for what is bounded.                       (3)
//             A parabola that rises by b t + p t^2 / 2, p > 0, is so high from a root of it on.  (4)
// Assumes     k >= 0, c >= 0
// Accuracy    margin 2^-30 of the terms, far above rounding
#pragma once

#include "vibroimpact/system/hybrid.hpp"

namespace vi {

namespace detail {

struct extent {
    double low, high;
};

template <class Guard, class Flow, int D>
VI_HD inline extent share_of_block(const Guard& g, const Flow& flow, const vec<double, D>& y, int j,
                                   double time) {
    const double r = g.rows[0][2 * j], s = g.rows[0][2 * j + 1], q = y[2 * j], v = y[2 * j + 1];
    const double k = flow.k[j], a = flow.a[j];
    if (k > 0.0) { // (1)
        const double rest = r * (a / k), from_rest = (r * q + s * v) - rest;
        const double speed = r * v + s * ((a - k * q) - flow.c[j] * v);
        const double size = sqrt(from_rest * from_rest + speed * speed / k);
        return {rest - size, rest + size};
    }
    const double way = r * v * time; // (2)
    const double off = (abs(r) * time + abs(s)) * (abs(a) * time) + abs(s * v);
    return {r * q + (min(way, 0.0) - off), r * q + (max(way, 0.0) + off)};
}

} // namespace detail

// Whether the contact of g stays between its limits, from the state y on, for so long.
template <class Guard, class Flow, int D>
VI_HD inline bool stays_clear(const Guard& g, const Flow& flow, const vec<double, D>& y,
                              double time) {
    double low = g.gains[0], high = g.gains[0], terms = abs(g.gains[0]) + g.reach;
    for (int j = 0; j < flow.blocks(); ++j) {
        const auto w = detail::share_of_block(g, flow, y, j, time);
        low = low + w.low;
        high = high + w.high;
        terms = terms + max(abs(w.low), abs(w.high));
    }
    const double margin = proof_margin * terms;
    return low - margin > g.lower && high + margin < g.upper;
}

// After what time the contact of g has surely met a limit: what no spring holds drifts, the rest stays
// within bounds. Infinite where that is not known, a drift within rounding of zero included.
template <class Guard, class Flow, int D>
VI_HD inline double surely_met(const Guard& g, const Flow& flow, const vec<double, D>& y) {
    double low = g.gains[0], high = g.gains[0], rate = 0.0, bend = 0.0, pulls = 0.0;
    for (int j = 0; j < flow.blocks(); ++j) {
        const double r = g.rows[0][2 * j], s = g.rows[0][2 * j + 1], q = y[2 * j], v = y[2 * j + 1];
        const double k = flow.k[j], c = flow.c[j], a = flow.a[j];
        if (k > 0.0) {
            const auto w = detail::share_of_block(g, flow, y, j, 0.0);
            low = low + w.low;
            high = high + w.high;
            continue;
        }
        const double steady =
            c > 0.0 ? a / c : v; // q' in the end, and how far q is off that then (3)
        const double off = c > 0.0 ? (v - steady) / c : 0.0;
        const double from = r * q + s * v, to = r * (q + off) + s * steady;
        low = low + min(from, to) - abs(s * (v - steady));
        high = high + max(from, to) + abs(s * (v - steady));
        rate = rate + (r * steady + (c > 0.0 ? 0.0 : s * a));
        bend = bend + (c > 0.0 ? 0.0 : r * a);
        pulls = pulls + abs(r * a);
    }
    if (!(abs(bend) > proof_margin * pulls)) bend = 0.0;
    const double lost = 64.0 * unit_roundoff * magnitude(g, 1, y, flow);
    if (bend == 0.0 && !(abs(rate) > lost)) return infinity();
    const bool rises = (bend != 0.0 ? bend : rate) > 0.0;
    const double way = rises ? g.upper - low : high - g.lower, along = rises ? rate : -rate;
    const double most = (1.0 + proof_margin) * max(way, 0.0);
    if (bend == 0.0) return most / along;
    return (sqrt(along * along + 2.0 * abs(bend) * most) - along) / abs(bend); // (4)
}

} // namespace vi
