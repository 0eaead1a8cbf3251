// Reach of u in a while, by what the blocks of a modal flow can add up to.
//
// Method      A block's share of u = row . y + gain, w = r q + s q', has (w - r a / k)^2 + w'^2 / k not
//             growing where k > 0, c >= 0 (theory T16e): it stays within the root of that around its
//             rest. As w' and w'' are motions of the same kind, with a = 0, so do they around zero: the
//             share goes no further than by |w'| t, nor from w + w' t than by |w''| t^2 / 2.       (1)
//             Where k = 0, q'' = (a - c q') exp(-c t) of the present one: q' changes one way, by
//             (a - c q') min(t, 1 / c) at most, and q by t times what lies between the two; where
//             a = 0, one way by q' min(t, 1 / c) at most.                                          (2)
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
    double low, high, terms; // terms: what rounding is relative to
};

// x t, where no time is long for what stands still.
VI_HD inline double way_in(double x, double time) {
    return x == 0.0 ? 0.0 : x * time;
}

template <class Guard, class Flow, int D>
VI_HD inline extent share_of_block(const Guard& g, const Flow& flow, const vec<double, D>& y, int j,
                                   double time) {
    const double r = g.rows[0][2 * j], s = g.rows[0][2 * j + 1], q = y[2 * j], v = y[2 * j + 1];
    const double k = flow.k[j], c = flow.c[j], a = flow.a[j], now = r * q + s * v;
    if (k > 0.0) { // (1)
        const double rest = r * (a / k), from_rest = now - rest;
        const double speed = r * v + s * ((a - k * q) - c * v);
        const double size = sqrt(from_rest * from_rest + speed * speed / k);
        const double bend = -(k * from_rest + c * speed), turn = -(k * speed + c * bend);
        const double way = way_in(speed, time);
        const double most = way_in(sqrt(speed * speed + bend * bend / k), time);
        const double off = way_in(0.5 * sqrt(bend * bend + turn * turn / k), time) * time;
        const double below = min(most, off - min(way, 0.0)), above = min(most, off + max(way, 0.0));
        return {max(rest - size, now - below), min(rest + size, now + above), abs(rest) + size};
    }
    const double lasts = c > 0.0 ? min(time, 1.0 / c) : time; // (2)
    const double change = way_in(a - c * v, lasts);
    double ahead, back;
    if (a == 0.0) {
        const double way = way_in(v, lasts);
        ahead = max(way, 0.0);
        back = min(way, 0.0);
    } else {
        ahead = way_in(max(max(v, v + change), 0.0), time);
        back = way_in(min(min(v, v + change), 0.0), time);
    }
    extent e{now, now, 0.0};
    if (r != 0.0) {
        e.low = e.low + (r > 0.0 ? r * back : r * ahead);
        e.high = e.high + (r > 0.0 ? r * ahead : r * back);
    }
    if (s != 0.0) {
        e.low = e.low + min(s * change, 0.0);
        e.high = e.high + max(s * change, 0.0);
    }
    const double low = abs(e.low), high = abs(e.high);
    e.terms = max(abs(r * q) + abs(s * v),
                  max(low < infinity() ? low : 0.0, high < infinity() ? high : 0.0));
    return e;
}

} // namespace detail

// Whether the contact of g stays between its limits, from the state y on, for so long, for ever perhaps.
template <class Guard, class Flow, int D>
VI_HD inline bool stays_clear(const Guard& g, const Flow& flow, const vec<double, D>& y,
                              double time) {
    double low = g.gains[0], high = g.gains[0], terms = abs(g.gains[0]) + g.reach;
    for (int j = 0; j < flow.blocks(); ++j) {
        const auto w = detail::share_of_block(g, flow, y, j, time);
        low = low + w.low;
        high = high + w.high;
        terms = terms + w.terms;
    }
    const double margin = proof_margin * terms;
    return (g.lower == -infinity() || low - margin > g.lower) &&
           (g.upper == infinity() || high + margin < g.upper);
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
            const auto w = detail::share_of_block(g, flow, y, j, infinity());
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
