// Where a flight first meets a stop, proved without marching: a grid of future times at once.
//
// Method      u at each time of a grid of the flow is one row times the state, so all of them are
//             known after one product. With M >= |u''| over the flight and 0, 1 the ends of an
//             interval of length h (theory T15, T16):
//               u stays below the upper limit if  u0 + u1 < 2 upper - M h^2 / 2 and u1 < upper  (1)
//               (an interior maximum exceeds the mean of the ends by at most M h^2 / 4), and
//               likewise above the lower one. On a stop u0 is that limit exactly.
//               u crosses once if u1 is past the limit and |u1 - u0| > M h^2 / 2              (2)
//               (u' differs from its mean over the interval by at most M h / 2).
//             M: each block's share w of u has w' a solution of the homogeneous equation, whose
//             energy decays, so |w''| <= sqrt(w''(0)^2 + k w'(0)^2).                            (3)
//             The interval to look at is found from the signs alone; (1) then has to hold for all
//             before it. So nothing waits for M.
// Assumes     the free mode of a modal flow, k >= 0, c >= 0; touching contacts leave: rate >= 0
// Accuracy    margin 2^-30 of the terms in (1), (2), far above rounding
// Fails       says how far it is clear, and nothing of what follows
// Reference   theory.md, "First contact"
#pragma once

#include "vibroimpact/event/certified_flight.hpp"
#include "vibroimpact/hybrid.hpp"

namespace vi {

inline constexpr double proof_margin = 0x1p-30;

namespace detail {

// A flight on its way: where it is, what each contact sees there, what holds for all of it.
template <class T, class Shape>
struct approach {
    using real = real_t<T>;
    vec<T, Shape::max_dimension> y;
    real t;
    mask_t<T> active; // neither landed nor given up
    vec<real, Shape::max_contacts> u;
    vec<real, Shape::max_contacts> curvature, margin;
};

// The interval in which it lands: it begins where the approach is, and the contact sees u0, u1 at
// its ends, u2 one interval later.
template <class R>
struct crossing {
    mask_t<R> found;
    R contact, side, length, limit, u0, u1, u2;
};

template <class M, class T, int D>
VI_HOT void select_state(const M& mask, vec<T, D>& to, const vec<T, D>& from, int n) {
    for (int i = 0; i < n; ++i)
        to[i] = select(mask, from[i], to[i]);
}

// What a contact knows of a flight from its start: the bound M, the size of the terms of u.
template <class R>
struct outlook {
    R curvature, terms;
};
template <class R, class G, class Flow, int D>
VI_HOT outlook<R> look_out(const G& g, const Flow& flow, const vec<R, D>& y) {
    outlook<R> o{R(0.0), R(0.0)};
    const auto share = [&](int order, int j) { // of block j in u^(order)
        return g.rows[order][2 * j] * y[2 * j] + g.rows[order][2 * j + 1] * y[2 * j + 1];
    };
    for (int j = 0; j < flow.blocks(); ++j) {
        const R w1 = share(1, j) + g.rows[0][2 * j + 1] * flow.a[j];
        const R w2 = share(2, j) + g.rows[1][2 * j + 1] * flow.a[j];
        o.curvature = o.curvature + sqrt(w2 * w2 + flow.k[j] * (w1 * w1)); // (3)
        o.terms = o.terms + (abs(g.rows[0][2 * j] * y[2 * j]) +
                             abs(g.rows[0][2 * j + 1] * y[2 * j + 1]) + flow.step * abs(w1));
    }
    return o;
}

template <class T, class Mode, class Shape>
VI_HOT approach<T, Shape> depart(const Mode& m, const trajectory<T, Shape>& start) {
    using R = real_t<T>;
    const int n = m.flow.dimension();
    const auto& z = values_of(start.y, n);
    approach<T, Shape> a{start.y, R(0.0), R(0.0) == R(0.0), {}, {}, {}};
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const auto& g = m.guards[i];
        const auto o = look_out(g, m.flow, z);
        const R side = start.touching[i], rate = value(start.rate[i]);
        a.u[i] = select(side > 0.0, g.upper, select(side < 0.0, g.lower, watch(g, 0, z, n)));
        a.curvature[i] = o.curvature;
        a.margin[i] = proof_margin * (o.terms + g.reach);
        // slower departures are left to the certified flight: chatter may have to be summed
        const R slow = 8.0 * unit_roundoff * o.curvature * (o.terms + g.reach); // squared
        a.active = a.active & ((side == 0.0) | ((rate > 0.0) & (rate * rate > slow)));
    }
    return a;
}

// (1) as limits: both ends' sum and the far end must lie between them.
template <class R>
struct corridor {
    R bulge, sum_low, sum_high, low, high;

    VI_HD mask_t<R> clear(const R& u0, const R& u1) const {
        const R sum = u0 + u1;
        return (sum < sum_high) & (sum > sum_low) & (u1 < high) & (u1 > low);
    }
};
template <class R, class G>
VI_HOT corridor<R> between_stops(const G& g, const R& curvature, const R& margin, const R& h) {
    const R bulge = 0.5 * curvature * (h * h) + margin;
    return {bulge, 2.0 * g.lower + bulge, 2.0 * g.upper - bulge, g.lower + margin,
            g.upper - margin};
}

// The last interval of a grid serves only to look one time further.
inline constexpr int grid_intervals = grid_times - 1;
template <class R>
using foresight = vec<R, grid_times + 2>; // u at 0, 1, ... spacings; the last entry is never read

// u at the beginning of a grid and at its times.
template <class R, class P, int D>
VI_HOT foresight<R> foresee(const preview<P, D>& ahead, const R& u0, const vec<R, D>& y, int n) {
    const auto sum = watch_all(ahead, y, n);
    foresight<R> u;
    u[0] = u0;
    for (int k = 0; k < grid_times; ++k)
        u[k + 1] = sum[k];
    u[grid_times + 1] = u0;
    return u;
}

// How many intervals of a grid come before the first that is not clear (1).
template <class R, class Mode, int N>
VI_HOT place_t<R> clear_intervals(const Mode& m, const foresight<R> (&u)[N],
                                  const corridor<R> (&free)[N]) {
    place_t<R> count{};
    mask_t<R> clear = R(0.0) == R(0.0);
    for (int k = 0; k < grid_intervals; ++k) {
        for (int i = 0; i < m.flow.contacts(); ++i)
            clear = clear & free[i].clear(u[i][k], u[i][k + 1]);
        if (!any(clear)) break;
        for (int i = 0; i < scalar_traits<R>::lanes; ++i)
            count.of[i] = count.of[i] + lane(clear, i);
    }
    return count;
}

// (2) for the interval that begins at `at`, with every other contact clear; where, into hit.
template <class R, class Mode, int N>
VI_HOT mask_t<R> crosses(const Mode& m, const foresight<R> (&u)[N], const corridor<R> (&free)[N],
                         const place_t<R>& at, const mask_t<R>& going, crossing<R>& hit) {
    mask_t<R> once = R(0.0) != R(0.0), single = !once;
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const auto& g = m.guards[i];
        const R u0 = pick(u[i], at), u1 = pick(u[i], at + 1), sum = u0 + u1, rise = u1 - u0;
        const mask_t<R> up = (u1 > g.upper) & (rise > free[i].bulge) & (sum > free[i].sum_low);
        const mask_t<R> down = (u1 < g.lower) & (-rise > free[i].bulge) & (sum < free[i].sum_high);
        const mask_t<R> mine = up | down, clear = free[i].clear(u0, u1);
        single = single & (clear | (mine & !once));
        once = once | mine;
        const mask_t<R> write = going & mine;
        hit.contact = select(write, R(static_cast<double>(i)), hit.contact);
        hit.side = select(write, select(down, R(-1.0), R(1.0)), hit.side);
        hit.limit = select(write, select(down, R(g.lower), R(g.upper)), hit.limit);
        hit.u0 = select(write, u0, hit.u0);
        hit.u1 = select(write, u1, hit.u1);
        hit.u2 = select(write, pick(u[i], at + 2), hit.u2);
    }
    return once & single;
}

// Goes on to the interval in which the flight lands, or to the end of what is clear; answers which
// lanes are stuck there.
template <int Which, class T, class Mode, class Shape>
VI_HOT mask_t<T> look_ahead(const Mode& m, const mask_t<T>& going, approach<T, Shape>& a,
                            crossing<real_t<T>>& hit) {
    using R = real_t<T>;
    const auto& flow = m.flow;
    const int n = flow.dimension();
    const auto spacing = flow.step * grid_steps[Which];
    foresight<R> u[Shape::max_contacts];
    corridor<R> free[Shape::max_contacts];
    for (int i = 0; i < flow.contacts(); ++i) {
        u[i] = foresee(m.guards[i].ahead[Which], a.u[i], values_of(a.y, n), n);
        free[i] = between_stops(m.guards[i], a.curvature[i], a.margin[i], R(spacing));
    }
    const auto to = clear_intervals(m, u, free);
    mask_t<T> on = going;
    for (int i = 0; i < scalar_traits<R>::lanes; ++i)
        if (to.of[i] == grid_intervals) set_lane(on, i, false);
    const mask_t<T> found = on & crosses(m, u, free, to, on, hit);
    hit.found = hit.found | found;
    hit.length = select(found, R(spacing), hit.length);
    select_state(going, a.y, flow.apply(flow.grid[Which], to, a.y), n);
    a.t = select(going, a.t + as_real<R>(to) * spacing, a.t);
    for (int i = 0; i < flow.contacts(); ++i)
        a.u[i] = select(going, pick(u[i], to), a.u[i]);
    return on & !found;
}

} // namespace detail
} // namespace vi
