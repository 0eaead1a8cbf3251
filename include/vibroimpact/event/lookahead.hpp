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

// A contact as seen from where a flight is: u there, M for all that follows, the margin of proofs.
template <class R>
struct outlook {
    R u, curvature, margin;
};

template <class R, class G, class Flow, int D>
VI_HOT outlook<R> look_out(const G& g, const Flow& flow, const vec<R, D>& y, const R& side) {
    R curvature = R(0.0), terms = R(0.0);
    const auto share = [&](int order, int j) { // of block j in u^(order)
        return fma(g.rows[order][2 * j + 1], y[2 * j + 1], g.rows[order][2 * j] * y[2 * j]);
    };
    for (int j = 0; j < flow.blocks(); ++j) {
        const R w1 = fma(g.rows[0][2 * j + 1], flow.a[j], share(1, j));
        const R w2 = fma(g.rows[1][2 * j + 1], flow.a[j], share(2, j));
        curvature = curvature + sqrt(fma(w2, w2, flow.k[j] * (w1 * w1))); // (3)
        terms = terms + (abs(g.rows[0][2 * j] * y[2 * j]) +
                         abs(g.rows[0][2 * j + 1] * y[2 * j + 1]) + flow.step * abs(w1));
    }
    const R u = watch(g, 0, y, flow.dimension());
    return {select(side == 0.0, u, select(side > 0.0, R(g.upper), R(g.lower))), curvature,
            proof_margin * (terms + g.reach)};
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
VI_HOT corridor<R> between_stops(const G& g, const outlook<R>& o, const R& h) {
    const R bulge = 0.5 * o.curvature * (h * h) + o.margin;
    return {bulge, 2.0 * g.lower + bulge, 2.0 * g.upper - bulge, g.lower + o.margin,
            g.upper - o.margin};
}

// What a look along a grid finds: so many intervals are clear, then comes one in which a contact,
// seen as u0, u1 at its ends and u2 one interval later, crosses its limit once, or is not proved to.
template <class R>
struct sight {
    R clear;
    mask_t<R> found;
    R contact, side, limit, u0, u1, u2;
};

// The last interval of a grid serves only to look one time further.
inline constexpr int grid_intervals = grid_times - 1;

template <class R>
struct three {
    R u0, u1, u2;
};

// u of one contact at the start of a grid and at its times.
template <class R>
using foresight = vec<R, grid_times + 1>;
template <class R, class P, int D>
VI_HOT foresight<R> foresee(const P& ahead, const R& u0, const vec<R, D>& y, int n) {
    const auto sum = watch_all(ahead, y, n);
    foresight<R> u;
    u[0] = u0;
    for (int k = 0; k < grid_times; ++k)
        u[k + 1] = sum[k];
    return u;
}

// (2) for one contact.
template <class R, class G>
VI_HOT void note_crossing(const G& g, int i, const corridor<R>& free, const three<R>& u,
                          mask_t<R>& once, mask_t<R>& single, sight<R>& s) {
    const R sum = u.u0 + u.u1, rise = u.u1 - u.u0;
    const mask_t<R> up = (u.u1 > g.upper) & (rise > free.bulge) & (sum > free.sum_low);
    const mask_t<R> down = (u.u1 < g.lower) & (-rise > free.bulge) & (sum < free.sum_high);
    const mask_t<R> mine = up | down;
    single = single & (free.clear(u.u0, u.u1) | (mine & !once));
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

// `from` holds u at the start of the grid; at the end, at the start of the interval in question.
template <int Which, class R, class Mode, int D, int K>
VI_HOT sight<R> look_along(const Mode& m, vec<outlook<R>, K>& from, const vec<R, D>& y) {
    const auto& flow = m.flow;
    const int n = flow.dimension();
    const R h = R(flow.step * (grid_parts[Which] * (1.0 / parts_of_step)));
    foresight<R> u[K];
    corridor<R> free[K];
    three<R> now[K];
    for (int i = 0; i < flow.contacts(); ++i) {
        u[i] = foresee(m.guards[i].ahead[Which], from[i].u, y, n);
        free[i] = between_stops(m.guards[i], from[i], h);
        now[i] = {u[i][0], u[i][1], u[i][2]};
    }
    sight<R> s;
    s.clear = R(0.0);
    mask_t<R> open = R(0.0) == R(0.0);
    for (int k = 0; k < grid_intervals; ++k) {
        for (int i = 0; i < flow.contacts(); ++i)
            open = open & free[i].clear(u[i][k], u[i][k + 1]);
        s.clear = s.clear + select(open, R(1.0), R(0.0));
        if (k + 1 == grid_intervals) break;
        for (int i = 0; i < flow.contacts(); ++i)
            now[i] = {select(open, u[i][k + 1], now[i].u0), select(open, u[i][k + 2], now[i].u1),
                      select(open, u[i][k + 3], now[i].u2)};
    }
    mask_t<R> once = R(0.0) != R(0.0), single = !once;
    for (int i = 0; i < flow.contacts(); ++i) {
        note_crossing(m.guards[i], i, free[i], now[i], once, single, s);
        from[i].u = now[i].u0;
    }
    s.found = once & single & !open;
    return s;
}

} // namespace detail
} // namespace vi
