// Where a flight first meets a stop, proved without marching: a grid of future times at once.
//
// Method      u at each time of a grid of the flow is one row times the state, so all of them are
//             known after one product. Over an interval of length h with 0, 1 its ends,
//               u'' h^2 lies between min(D0, D1) - e and max(D0, D1) + e,  e = 5/24 M h^4      (1)
//             with D_k = u_{k+1} - 2 u_k + u_{k-1} (u'' h^2 itself at the start) and M >= |u''''|
//             over the flight (theory T16a). So (theory T15, T16), lo and hi the bounds (1),
//               u stays below the upper limit if  2 (u0 + u1) - lo < 4 upper and u1 < upper    (2)
//             and likewise above the lower one. On a stop u0 is that limit exactly.
//               u crosses once if u0 is before the limit, u1 past it, and u' or u'' keeps its
//               sign: 2 |u1 - u0| > max(-lo, hi), or lo > 0, or hi < 0; and the other limit is
//               kept away from as in (2).                                                    (3)
//             M: each block's share w of u has w''' a solution of the homogeneous equation, whose
//             energy decays, so |w''''| <= sqrt(w''''(0)^2 + k w'''(0)^2).                     (4)
//             The interval to look at is found from the signs alone; (2) then has to hold for all
//             before it. So nothing waits for M.
// Assumes     the free mode of a modal flow, k >= 0, c >= 0; no contact is behind a stop, and those
//             that touch leave: rate >= 0
// Accuracy    margin 2^-30 of the terms in (2), (3), far above rounding
// Fails       says how far it is clear, and nothing of what follows
// Reference   theory.md, "First contact"
#pragma once

#include "vibroimpact/event/certified_flight.hpp"
#include "vibroimpact/hybrid.hpp"

namespace vi {

inline constexpr double proof_margin = 0x1p-30;

namespace detail {

// A contact as seen from where a flight is: u and u'' there, M for all that follows, the margin of
// proofs.
template <class R>
struct outlook {
    R u, second, fourth, margin;
};

template <class R, class G, class Flow, int D>
VI_HOT outlook<R> look_out(const G& g, const Flow& flow, const vec<R, D>& y, const R& side) {
    const int n = flow.dimension();
    R fourth = g.least_fourth, terms = g.least_terms;
    const auto share = [&](int order, int j) { // of block j in u^(order)
        const R moved =
            fma(g.rows[order][2 * j], y[2 * j], g.rows[order - 1][2 * j + 1] * flow.a[j]);
        return fma(g.rows[order][2 * j + 1], y[2 * j + 1], moved);
    };
    flow.each_oscillator([&](auto j) {
        const R w3 = share(3, j), w4 = share(4, j);
        fourth = fourth + sqrt(fma(w4, w4, flow.k[j] * (w3 * w3))); // (4)
        terms = fma(g.weights[2 * j], abs(y[2 * j]),
                    fma(g.weights[2 * j + 1], abs(y[2 * j + 1]), terms));
    });
    const R u = watch(g, 0, y, n);
    return {select(side == 0.0, u, select(side > 0.0, R(g.upper), R(g.lower))), watch(g, 2, y, n),
            fourth, proof_margin * terms};
}

// (2) as limits: twice the sum of the ends less the bend, and the far end must lie between them.
template <class R>
struct corridor {
    R slack, sum_low, sum_high, low, high;

    template <class G>
    VI_HOT void lead(const G& g, const outlook<R>& o, const R& h2) {
        slack = fma(5.0 / 24 * o.fourth, h2 * h2, 2.0 * o.margin);
        sum_low = 4.0 * g.lower + slack;
        sum_high = 4.0 * g.upper - slack;
        low = g.lower + o.margin;
        high = g.upper - o.margin;
    }
    VI_HOT mask_t<R> clear(const R& u0, const R& u1, const R& least, const R& most) const {
        const R sum = u0 + u1, twice = sum + sum;
        return (twice - least < sum_high) & (twice - most > sum_low) & (u1 < high) & (u1 > low);
    }
};

// What a look along a grid finds: all is clear up to `begin`, in parts of a step; then comes an
// interval of some `length` in which a contact, seen as u0, u1 at its ends and u2 one interval later,
// crosses its limit once, or is not proved to.
template <class R>
struct sight {
    R clear, begin, length; // clear: so many intervals of the wide grid
    mask_t<R> found;
    R contact, side, limit, u0, u1, u2;
};

// The last interval of a grid serves only to look one time further.
inline constexpr int grid_intervals = grid_times - 1;

// An interval of one contact: D0 at its start, u at its ends and one interval later.
template <class R>
struct interval {
    R bend, u0, u1, u2;
};

// (3) for one contact.
template <class R, class G>
VI_HOT void note_crossing(const G& g, int i, const corridor<R>& free, const interval<R>& u,
                          mask_t<R>& once, mask_t<R>& single, sight<R>& s) {
    const R sum = u.u0 + u.u1, twice = sum + sum, rise = u.u1 - u.u0;
    const R next = (u.u2 - u.u1) - rise;
    const R least = min(u.bend, next), most = max(u.bend, next);
    const R steep = max(most, -least) + free.slack;
    const mask_t<R> bent = (least > free.slack) | (most < -free.slack);
    const mask_t<R> up = (u.u1 > g.upper) & (u.u0 < g.upper) & ((2.0 * rise > steep) | bent) &
                         (twice - most > free.sum_low);
    const mask_t<R> down = (u.u1 < g.lower) & (u.u0 > g.lower) & ((-2.0 * rise > steep) | bent) &
                           (twice - least < free.sum_high);
    const mask_t<R> mine = up | down;
    single = single & (free.clear(u.u0, u.u1, least, most) | (mine & !once));
    once = once | mine;
    s.contact = i == 0 ? R(0.0) : select(mine, R(static_cast<double>(i)), s.contact);
    s.side = i == 0 ? select(down, R(-1.0), R(1.0))
                    : select(mine, select(down, R(-1.0), R(1.0)), s.side);
    s.limit = i == 0 ? select(down, R(g.lower), R(g.upper))
                     : select(mine, select(down, R(g.lower), R(g.upper)), s.limit);
    s.u0 = i == 0 ? u.u0 : select(mine, u.u0, s.u0);
    s.u1 = i == 0 ? u.u1 : select(mine, u.u1, s.u1);
    s.u2 = i == 0 ? u.u2 : select(mine, u.u2, s.u2);
}

// A contact along a grid, interval by interval.
template <class R>
struct along_grid {
    R u[grid_times + 1]; // at the start of the grid and at its times
    corridor<R> free;
    interval<R> now; // the first interval that is not clear
    R bend, rise;    // D0 and u1 - u0 of the interval in turn

    template <class G, class P, int D, class S>
    VI_HOT void begin(const G& g, const outlook<R>& from, const P& ahead, const R& h2,
                      const vec<R, D>& y, const S& size) {
        const auto sum = watch_all(ahead, y, size);
        u[0] = from.u;
        unrolled<0, grid_times>([&](auto k) { u[k + 1] = sum[k]; });
        free.lead(g, from, h2);
        bend = from.second * h2;
        rise = u[1] - u[0];
        now.bend = bend;
        now.u0 = u[0];
        now.u1 = u[1];
        now.u2 = u[2];
    }
    // Whether interval k is clear; the next one comes in turn.
    VI_HOT mask_t<R> pass(int k) {
        const R next_rise = u[k + 2] - u[k + 1], next = next_rise - rise;
        const auto clear = free.clear(u[k], u[k + 1], min(bend, next), max(bend, next));
        bend = next;
        rise = next_rise;
        return clear;
    }
    VI_HOT void look_at(const mask_t<R>& open, int k) {
        now.bend = select(open, bend, now.bend);
        now.u0 = select(open, u[k], now.u0);
        now.u1 = select(open, u[k + 1], now.u1);
        now.u2 = select(open, u[k + 2], now.u2);
    }
};

template <int Which, class R, class Mode, int D, int K>
VI_HOT void look_along(const Mode& m, const vec<outlook<R>, K>& from, const vec<R, D>& y,
                       sight<R>& s) {
    const auto& flow = m.flow;
    const R h = R(flow.step * (grid_parts[Which] * (1.0 / parts_of_step))), h2 = h * h;
    along_grid<R> all[K];
    for (int i = 0; i < flow.contacts(); ++i)
        all[i].begin(m.guards[i], from[i], m.guards[i].ahead[Which], h2, y, flow);
    R clear = R(0.0);
    mask_t<R> open = R(0.0) == R(0.0);
    unrolled<0, grid_intervals>([&](auto k) {
        for (int i = 0; i < flow.contacts(); ++i)
            open = open & all[i].pass(k);
        clear = clear + select(open, R(1.0), R(0.0));
        if constexpr (k + 1 != grid_intervals)
            for (int i = 0; i < flow.contacts(); ++i)
                all[i].look_at(open, k + 1);
    });
    s.clear = clear;
    s.length = R(double(grid_parts[Which]));
    s.begin = clear * s.length;
    s.contact = s.side = s.limit = s.u0 = s.u1 = s.u2 = R(0.0);
    mask_t<R> once = R(0.0) != R(0.0), single = !once;
    for (int i = 0; i < flow.contacts(); ++i)
        note_crossing(m.guards[i], i, all[i].free, all[i].now, once, single, s);
    s.found = once & single & !open;
}

} // namespace detail
} // namespace vi
