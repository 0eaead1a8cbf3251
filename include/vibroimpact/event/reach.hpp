// How far u can get in a while, by what the blocks of a modal flow can add up to.
//
// Method      A block's share of u = row . y + gain, w = r q + s q', has (w - r a / k)^2 + w'^2 / k not
//             growing where k > 0, c >= 0 (theory T16e): it stays within the root of that around its
//             rest.                                                                      (1)
//             Where k = 0, q' goes no further from 0 than by |a| t: the share follows r q' t one way,
//             and is off by (|r| t + |s|) |a| t + |s q'| at most.                        (2)
// Assumes     k >= 0, c >= 0
// Accuracy    margin 2^-30 of the terms, far above rounding
#pragma once

#include "vibroimpact/hybrid.hpp"

namespace vi {

inline constexpr double proof_margin = 0x1p-30;

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

} // namespace vi
