// First stop that a flight meets, proved without marching: a grid of future times at once.
//
// Method      u at each time of a grid of the flow is one row times the state, so all of them are
//             known after one product. With D_k = u_{k+1} - 2 u_k + u_{k-1}, over the interval from
//             time k to k + 1, of length h,
//               u'' h^2 is the straight line from D_k to D_{k+1} within e = 5/24 M h^4,
//               M >= |u''''| over the flight                                             (1)
//             (theory T16a); u_{-1} is chosen such that D_0 is u'' h^2 at the start. Such a curve
//             stays between its limits if its ends do and, by e/4, its two corners:
//               u_k + (u_{k+1} - u_{k-1})/4  and  u_{k+1} - (u_{k+2} - u_k)/4             (2)
//             (theory T15). On a stop u0 is that limit exactly. The first interval for which this does
//             not hold is examined once more, by the inner Bezier points of the cubic with D_k and
//             D_{k+1}: they lie closer to the curve, and have to keep away by e/6 only (theory T16h).
//               u crosses once if u0 is between the limits, u1 past one, and u' or u'' keeps its
//             sign; u' does if the Bezier points of its parabola do, by e/2 (theory T16i). It comes
//             back once onto the stop that it leaves if u1 is past that and u'' keeps its sign. It
//             keeps away from the other limit meanwhile if its inner points do.             (3)
//             M: each block's share w of u has w''' a solution of the homogeneous equation, whose
//             energy decays, so |w''''| <= sqrt(a^2 + b^2), a = w''''(0), b = sqrt(k) w'''(0):
//             at most max(|a|, |b|) + (sqrt 2 - 1) min(|a|, |b|).                         (4)
// Assumes     the free mode of a modal flow, k >= 0, c >= 0; contacts that touch leave: rate >= 0
// Accuracy    margin 2^-30 of the terms in (2), (3), far above rounding
// Fails       says how far it is clear, and nothing of what follows; nothing of a contact that is not
//             surely between its stops, nor on one
// Reference   theory.md, "First contact"
#pragma once

#include "vibroimpact/search/certified_flight.hpp"
#include "vibroimpact/system/hybrid.hpp"

namespace vi {

namespace detail {

inline constexpr double root_of_two_less_one = 0.4142135623730951; // rounded up

// (4) of an oscillator.
template <class R, class G, class Flow, int D>
VI_HOT R swing(const G& g, const Flow& flow, const vec<R, D>& y, int j) {
    const auto share = [&](const auto& row, const auto& push) VI_WITHIN {
        const R &q = y[2 * j], &v = y[2 * j + 1];
        const R moving = flow.pushed ? fma(row[2 * j + 1], v, R(push[j])) : row[2 * j + 1] * v;
        return fma(row[2 * j], q, moving);
    };
    const R w3 = share(g.third, g.third_push), w4 = share(g.fourth, g.fourth_push);
    const R a = abs(w4), b = abs(w3);
    return fma(root_of_two_less_one, min(a, b), max(a, b));
}

// Size of the terms of u, with which it is bounded.
template <class R, class G, class Flow, int D>
VI_HOT R terms_of(const G& g, const Flow& flow, const vec<R, D>& y) {
    R terms = g.least_terms;
    flow.each_oscillator([&](auto j) VI_WITHIN {
        terms = fma(g.weights[2 * j], abs(y[2 * j]),
                    fma(g.weights[2 * j + 1], abs(y[2 * j + 1]), terms));
    });
    return terms;
}

// Bound M of (1) for the rest of the flight.
template <class R, class G, class Flow, int D>
VI_HOT R fourth_of(const G& g, const Flow& flow, const vec<R, D>& y) {
    R fourth = g.least_fourth;
    flow.each_oscillator([&](auto j) VI_WITHIN {
        if (!flow.template drifts<R>(j)) fourth = fourth + swing(g, flow, y, j);
    });
    return fourth;
}

// A stop that a flight ends on; of a single contact, `contact` is never written.
template <class R>
struct stop_hit {
    R contact = R(0.0), side, limit;

    template <class Shape>
    VI_HOT void take(const mask_t<R>& mask, const stop_hit& from, const sizes<Shape>& size) {
        side = select(mask, from.side, side);
        limit = select(mask, from.limit, limit);
        if (size.contacts() > 1) contact = select(mask, from.contact, contact);
    }
};

// Result of a scan along a grid, in parts of a step: all is clear up to `begin`. Either nothing is known
// of what follows, as the grid or the proof ends there (`clear`), or in the interval after it, of some
// `length`, a contact crosses its limit on some side once: `found`. Or neither. `place`, rounded when all
// is known, is that of the table next to the crossing, or `begin`. Where a flight comes back onto the stop
// that it leaves, it is proved to do so once up to the end of the interval, perhaps before `begin`; it is
// landed on from there on only.
template <class R>
struct scan_result {
    R begin, length, place;
    mask_t<R> clear, found;
    mask_t<R> several; // others may cross theirs in this interval, too, once and later
    stop_hit<R> stop;  // but for its limit
};

// The last interval of a grid only provides the time after the one before it.
inline constexpr int grid_intervals = grid_times - 1;

// The corners (2) of an interval.
template <class R>
struct corner_pair {
    R low, high;
};

// u at both ends of an interval, and one time before and after.
template <class R>
struct interval {
    R before, first, last, after;
    VI_HOT corner_pair<R> corners() const {
        const R leaving = fma(0.25, last - before, first);
        const R arriving = fnma(0.25, after - first, last);
        return {min(arriving, leaving), max(arriving, leaving)};
    }
    VI_HOT void take(const mask_t<R>& mask, const interval& s) {
        before = select(mask, s.before, before);
        first = select(mask, s.first, first);
        last = select(mask, s.last, last);
        after = select(mask, s.after, after);
    }
};

// Distances that (2) have to keep from the limits, e/4 and the margin, and u at the times of a grid.
template <class R>
struct distances {
    R slack, margin;
    template <class G>
    VI_HOT mask_t<R> kept(const G& g, const interval<R>& s) const {
        const auto corners = s.corners();
        return (corners.high < g.upper - slack) & (corners.low > g.lower + slack) &
               between(g, s.last);
    }
    template <class G>
    VI_HOT mask_t<R> between(const G& g, const R& u) const {
        return (u < g.upper - margin) & (u > g.lower + margin);
    }
};

// Whether u is between the limits, beyond rounding.
template <class R, class G, class Flow, int D>
VI_HOT mask_t<R> is_inside(const G& g, const Flow& flow, const vec<R, D>& y) {
    const R margin = proof_margin * terms_of(g, flow, y);
    return distances<R>{margin, margin}.between(g, guard_distance(g, y, flow));
}

// A contact where a scan begins: u, and whether that is between the stops or on one.
template <class R>
struct contact_location {
    R u;
    mask_t<R> inside;
};
template <class R, class G, class Flow, int D>
VI_HOT contact_location<R> locate(const G& g, const Flow& flow, const vec<R, D>& y, const R& side,
                                  const distances<R>& apart) {
    const R free = guard_distance(g, y, flow);
    const mask_t<R> open = side == 0.0;
    const R u = select(open, free, select(side > 0.0, R(g.upper), R(g.lower)));
    return {u, mask_t<R>((!open) | apart.between(g, free))};
}

// A contact along a grid.
template <class R>
struct along_grid {
    R before, now;            // u_{-1}, u_0
    vec<R, grid_times + 1> u; // u'' h^2, u_1, u_2, ...

    template <class G, class Flow, int D>
    VI_HOT void begin(const G& g, int grid, const Flow& flow, const R& u_now, const vec<R, D>& y) {
        guard_ahead(g.ahead[grid], y, flow, u);
        now = u_now;
        before = fma(2.0, now, u[0] - u[1]);
    }
    VI_HOT const R& at(int k) const { return k < 0 ? before : k == 0 ? now : u[k]; }
    VI_HOT interval<R> after_time(int k) const { return {at(k - 1), at(k), at(k + 1), at(k + 2)}; }
};

// The first interval that is not clear, for a contact.
template <class R>
struct open_interval {
    interval<R> u;
    distances<R> apart;
};

// Its cubic, with h = 1: how far it rises, u'' at the ends, and 6 u' there and between, as Bezier points.
template <class R>
struct cubic {
    R rise, bend0, bend1, start, end;
    VI_HOT explicit cubic(const interval<R>& u)
        : rise(u.last - u.first), bend0(rise - (u.first - u.before)),
          bend1((u.after - u.last) - rise) {
        const R sum = bend0 + bend1;
        start = fma(6.0, rise, -(sum + bend0));
        end = fma(6.0, rise, sum + bend1);
    }
    // The least |u''|, the least 6 |u'|; negative where that changes its sign.
    VI_HOT R bends() const { return max(min(bend0, bend1), -max(bend0, bend1)); }
    VI_HOT R steepness() const {
        const R middle = fma(6.0, rise, bend0 - bend1);
        return max(min(min(start, end), middle), -max(max(start, end), middle));
    }
};

// Inner Bezier points of the cubic.
template <class R>
struct inner_points {
    R low, high;
    VI_HOT inner_points(const interval<R>& u, const cubic<R>& c) {
        const R near = fma(1.0 / 18, c.start, u.first), far = fnma(1.0 / 18, c.end, u.last);
        low = min(near, far);
        high = max(near, far);
    }
};

// Place in (0, 1) where a cubic, as Everett writes it, is so far above its value at 0:
// x = ahead / rise + x (1 - x) bend(x), bend(x) = b0 + b1 x, to third order in bend.
template <class R>
VI_HOT R crossing_point(const R& ahead, const cubic<R>& u) {
    const R scale = 1.0 / u.rise, sixth = (1.0 / 6) * scale;
    const R b0 = fma(2.0, u.bend0, u.bend1) * sixth, b1 = (u.bend1 - u.bend0) * sixth;
    const R x = ahead * scale, width = fnma(x, x, x), bend = fma(b1, x, b0);
    const R slope = fma(width, b1, bend * fnma(2.0, x, 1.0));
    return fma(width * bend, fma(slope, slope, 1.0 + slope), x);
}

// Place where it is back at its value at 0: two Newton steps on 6 (its change) / x = c + b x + a x^2.
template <class R>
VI_RARE R point_of_return(const cubic<R>& u) {
    const R c = u.start, b = 3.0 * u.bend0, a = u.bend1 - u.bend0;
    R x = -c / b;
    for (int i = 0; i < 2; ++i)
        x = fma(a, x * x, -c) / fma(2.0 * a, x, b);
    return x;
}

// In parts of a step: no micro-bounce takes longer. A return that is predicted sooner is not landed on, nor
// one that turns out to be sooner: micro-bounces find those, and the start is a root, too. Intervals of the narrow
// grid of lively motions are as short as this: returns are not landed on in their first one.
inline constexpr double soonest_return = longest_bounce * parts_of_step;

// Verdict on a contact in the interval that is not clear by its corners: it crosses by (3), perhaps back
// onto the stop that it leaves, or is clear by the inner points.
template <class R>
struct meeting {
    mask_t<R> crosses, back, clear;
};
template <class R, class G>
VI_HOT meeting<R> meet(const G& g, int i, const open_interval<R>& at, scan_result<R>& s) {
    const auto& u = at.u;
    const R e = 4.0 * at.apart.slack, apart = (1.0 / 6) * e;
    const R& margin = at.apart.margin;
    const cubic<R> c(u);
    const inner_points<R> inner(u, c);
    const mask_t<R> above = inner.low > g.lower + apart, below = inner.high < g.upper - apart;
    const mask_t<R> down = below & (u.last < g.lower - margin);
    const mask_t<R> past = down | (above & (u.last > g.upper + margin));
    const R ahead = select(down, R(g.lower), R(g.upper)) - u.first;
    const mask_t<R> leaves = past & (ahead == 0.0), bent = c.bends() > e;
    meeting<R> out;
    out.crosses = past & !leaves & (bent | (c.steepness() > 3.0 * e));
    out.back = leaves & bent;
    out.clear = above & below & at.apart.between(g, u.last);
    R x = crossing_point(ahead, c);
    if (any(out.back)) {
        const R later = point_of_return(c);
        x = select(out.back, later, x);
        out.back = out.back & (s.length * later >= soonest_return);
        out.crosses = out.crosses | out.back;
    }
    const auto take = [&](R& to, const R& found)
                          VI_WITHIN { to = i == 0 ? found : select(out.crosses, found, to); };
    take(s.stop.side, select(down, R(-1.0), R(1.0)));
    take(s.place, fma(s.length, x, s.begin));
    if (i > 0) s.stop.contact = select(out.crosses, R(static_cast<double>(i)), s.stop.contact);
    return out;
}

// Of all contacts: whether some cross, the others being clear, or all are clear. Which crosses first is guessed: where
// it is landed on the others have to be between their limits still.
template <class R, class Guards, class Flow, int K>
VI_HOT meeting<R> meet_first(const Guards& guards, const Flow& flow,
                             const vec<open_interval<R>, K>& all, scan_result<R>& s) {
    s.stop.contact = R(0.0);
    auto out = meet(guards[0], 0, all[0], s);
    mask_t<R> known = out.crosses | out.clear;
    s.several = mask_t<R>(false);
    for (int i = 1; i < flow.contacts(); ++i) {
        auto one = s;
        const auto mine = meet(guards[i], 0, all[i], one);
        const mask_t<R> sooner = mine.crosses & ((!out.crosses) | (one.place < s.place));
        s.place = select(sooner, one.place, s.place);
        s.stop.side = select(sooner, one.stop.side, s.stop.side);
        s.stop.contact = select(sooner, R(static_cast<double>(i)), s.stop.contact);
        s.several = s.several | (mine.crosses & out.crosses);
        known = known & (mine.clear | mine.crosses);
        out.back = (sooner & mine.back) | ((!sooner) & out.back);
        out.crosses = out.crosses | mine.crosses;
        out.clear = out.clear & mine.clear;
    }
    out.crosses = out.crosses & known;
    return out;
}

// Meeting where exactly one gap may cross.
template <class R, class Guards, class Flow, int K>
VI_HOT meeting<R> meet_alone(const Guards& guards, const Flow& flow,
                             const vec<open_interval<R>, K>& all, scan_result<R>& s) {
    auto out = meet(guards[0], 0, all[0], s);
    if (flow.contacts() == 1) return out;
    s.stop.contact = R(0.0);
    mask_t<R> single = out.crosses | out.clear;
    for (int i = 1; i < flow.contacts(); ++i) {
        const auto mine = meet(guards[i], i, all[i], s);
        single = single & (mine.clear | (mine.crosses & !out.crosses));
        out.crosses = out.crosses | mine.crosses;
        out.back = out.back | mine.back;
        out.clear = out.clear & mine.clear;
    }
    out.crosses = out.crosses & single;
    return out;
}

// The place of the table nearest to x; 0 for NaN.
template <class R>
VI_HOT R nearest_place(const R& x) {
    return nearest(min(max(R(0.0), x), R(places - 1.0)));
}

// A scan along a grid, in two stages: how far all is clear, and what happens in the interval after that.
template <class R, int K>
class grid_scan {
public:
    scan_result<R> result;

    // From the state y; touching: 0, or the side of the stop that a contact is on.
    template <class Mode, int D>
    VI_HOT void scan(const Mode& m, int grid, const vec<R, D>& y, const vec<R, K>& touching) {
        const auto& flow = m.flow;
        along_grid<R> all[K];
        vec<open_interval<R>, K> open;
        mask_t<R> clear = mask_t<R>(true);
        flow.each_contact([&](auto i) VI_WITHIN {
            const auto& g = m.guards[i];
            const R margin = proof_margin * terms_of(g, flow, y);
            const R slack = fma(fourth_of(g, flow, y), flow.grid_error[grid], margin);
            const auto from = locate(g, flow, y, touching[i], {slack, margin});
            all[i].begin(g, grid, flow, from.u, y);
            open[i] = {all[i].after_time(0), {slack, margin}};
            clear = clear & from.inside;
        });
        inside_ = clear;
        const R length = flow.spacing[grid];
        R begin = R(0.0);
        unrolled<0, grid_intervals>([&](auto k) VI_WITHIN {
            flow.each_contact([&](auto i) VI_WITHIN {
                clear = clear & open[i].apart.kept(m.guards[i], all[i].after_time(k));
            });
            begin = plus_where(clear, begin, length);
            if constexpr (k + 1 != grid_intervals)
                flow.each_contact(
                    [&](auto i) VI_WITHIN { open[i].u.take(clear, all[i].after_time(k + 1)); });
        });
        result.begin = begin;
        result.length = length;
        result.clear = clear;
        open_ = open;
    }
    template <class Mode>
    VI_HOT void cross(const Mode& m) {
        const auto open = meets(m);
        const mask_t<R> undecided = inside_ & !result.clear;
        result.found = open.crosses & undecided;
        const mask_t<R> kept = open.clear & undecided;
        result.begin = plus_where(kept, result.begin, result.length);
        result.clear = result.clear | kept;
        result.place = select(result.found, nearest_place(result.place), result.begin);
        const mask_t<R> back = open.back & result.found;
        if (!any(back)) return;
        result.begin = plus_where(back, result.begin, R(soonest_return));
        result.length = plus_where(back, result.length, R(-soonest_return));
    }

private:
    template <class Mode>
    VI_HOT meeting<R> meets(const Mode& m) {
        if constexpr (Mode::flow_type::several_may_cross)
            return meet_first(m.guards, m.flow, open_, result);
        result.several = mask_t<R>(false);
        return meet_alone(m.guards, m.flow, open_, result);
    }

    mask_t<R> inside_;
    vec<open_interval<R>, K> open_;
};

} // namespace detail

} // namespace vi
