// The common flight, at the speed of a few multiply-adds per stride: all lanes at once.
//
// Method      From a free start the state goes on in rounds: leaps while there is room, then steps,
//             then creeps past a stop that is near. Each is one stored propagator; no elementary
//             function is called. With M >= |u''| over the flight and 0, 1 the ends of a stride h
//             (theory T15, T16):
//               u stays below the upper limit if  u0 + u1 < 2 upper - M h^2 / 2 and u1 < upper  (1)
//               (an interior maximum exceeds the mean of the ends by at most M h^2 / 4), and
//               likewise above the lower one. On a stop u0 is that limit exactly.
//               u crosses once if u1 is past the limit and u0' + u1' > M h                      (2)
//             M: each block's share w of u has w' a solution of the homogeneous equation, whose
//             energy decays, so |w''| <= sqrt(w''(0)^2 + k w'(0)^2).                            (3)
//             The root: predicted by the cubics with both ends' values and slopes, first of the
//             inverse of u, then of u (one Newton step); a Taylor flight there from the nearer end;
//             the inverse series of the gap there.
//             Whatever is not proved this way (several contacts in a stride, slow departure, a near
//             graze, the horizon) is left to certified_flight, from the start of the flight.
// Assumes     the free mode of a modal flow, k >= 0, c >= 0; touching contacts leave: rate >= 0
// Accuracy    margin 2^-30 of the terms in (1), (2), far above rounding; state: 4 ulp of the
//             amplitude per stride, at most 272 strides; time: the same divided by the rate
// Reference   theory.md, "First contact"
#pragma once

#include "vibroimpact/event/certified_flight.hpp"

namespace vi {

inline constexpr double proof_margin = 0x1p-30;
inline constexpr int most_rounds = 4;   // of leaps, steps and creeps
inline constexpr int most_strides = 32; // leaps or steps of a round
inline constexpr int most_creeps = 4;   // of a round: one step
inline constexpr int march_order = 14;  // (7/20)^15 / 15! < 2^-62: from the nearer end of a step
inline constexpr int landing_order = 4; // (7/10 2^-10)^5 / 120 < 2^-59: over the correction
inline constexpr double largest_correction = 0x1p-10; // of a step
inline constexpr double flattest =
    0x1p-10; // g'' e / g': the inverse series stops at its fourth power

template <class T, class Shape>
struct stride_landing {
    using real = real_t<T>;
    mask_t<T> proved;
    real contact, side;
    T duration, rate;
    vec<T, Shape::max_dimension> y;
};

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

// The stride in which it lands: from where the approach stands, where the contact sees u0, du0, to
// y, where it sees u1, du1.
template <class T, class Shape>
struct crossing {
    using real = real_t<T>;
    mask_t<T> found;
    real contact, side, length, u0, du0, u1, du1;
    vec<T, Shape::max_dimension> y;
};

template <Real R, int D>
VI_HD inline const vec<R, D>& values_of(const vec<R, D>& y, int) {
    return y; // NOLINT(bugprone-return-const-ref-from-parameter): only named states are passed
}
template <class T, int D>
VI_HD inline vec<real_t<T>, D> values_of(const vec<T, D>& y, int n) {
    vec<real_t<T>, D> out{};
    for (int i = 0; i < n; ++i)
        out[i] = value(y[i]);
    return out;
}

template <class M, class T, int D>
VI_HD inline void select_state(const M& mask, vec<T, D>& to, const vec<T, D>& from, int n) {
    for (int i = 0; i < n; ++i)
        to[i] = select(mask, from[i], to[i]);
}

// What a contact knows of a flight from its start: the bound M, the size of the terms of u.
template <class R>
struct outlook {
    R curvature, terms;
};
template <class R, class G, class Flow, int D>
VI_HD inline outlook<R> look_out(const G& g, const Flow& flow, const vec<R, D>& y) {
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
VI_HD inline approach<T, Shape> depart(const Mode& m, const trajectory<T, Shape>& start) {
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
    R sum_low, sum_high, low, high;
};
template <class R, class G>
VI_HD inline corridor<R> between_stops(const G& g, const R& curvature, const R& margin,
                                       const R& h) {
    const R bulge = 0.5 * curvature * (h * h) + margin;
    return {2.0 * g.lower + bulge, 2.0 * g.upper - bulge, g.lower + margin, g.upper - margin};
}

// A leap is tried where its straight continuation stays inside; whether it is clear (1) decides.
template <class T, class Mode, class Shape>
VI_HD inline mask_t<T> promising(const Mode& m, const approach<T, Shape>& a,
                                 const real_t<T>& length) {
    mask_t<T> inside = a.active;
    const auto& z = values_of(a.y, m.flow.dimension());
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const auto& g = m.guards[i];
        const auto ahead = a.u[i] + watch(g, 1, z, m.flow.dimension()) * length;
        inside = inside & (ahead < g.upper) & (ahead > g.lower);
    }
    return inside;
}

template <class R, int N>
struct verdict {
    mask_t<R> clear; // (1) for every contact
    mask_t<R> past;  // not clear, and past a stop, for exactly one contact
    R contact, side; // which
    vec<R, N> u;     // at the far end
};

template <class T, class Mode, class Shape>
VI_HD inline verdict<real_t<T>, Shape::max_contacts>
judge(const Mode& m, const approach<T, Shape>& a,
      const corridor<real_t<T>> (&free)[Shape::max_contacts],
      const vec<real_t<T>, Shape::max_dimension>& far) {
    using R = real_t<T>;
    const mask_t<T> no = R(0.0) != R(0.0);
    verdict<R, Shape::max_contacts> v{!no, no, R(0.0), R(1.0), {}};
    mask_t<T> several = no;
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const auto& g = m.guards[i];
        const R u = watch(g, 0, far, m.flow.dimension()), sum = a.u[i] + u;
        const mask_t<T> below = (sum < free[i].sum_high) & (u < free[i].high);
        const mask_t<T> above = (sum > free[i].sum_low) & (u > free[i].low);
        const mask_t<T> up = above & (u > g.upper), down = below & (u < g.lower);
        const mask_t<T> clear = below & above, past = up | down;
        several = several | !(v.clear | clear);
        v.clear = v.clear & clear;
        v.past = v.past | past;
        v.contact = select(past, R(static_cast<double>(i)), v.contact);
        v.side = select(down, R(-1.0), v.side);
        v.u[i] = u;
    }
    v.past = v.past & !several;
    return v;
}

// Where a stride ends past a stop: does it cross once (2)? Then it lands there.
template <class T, class Mode, class Shape>
VI_HD inline void record(const Mode& m, const approach<T, Shape>& a,
                         const vec<T, Shape::max_dimension>& far,
                         const verdict<real_t<T>, Shape::max_contacts>& v, const mask_t<T>& going,
                         const real_t<T>& length, crossing<T, Shape>& hit) {
    const int n = m.flow.dimension();
    const auto& here = values_of(a.y, n);
    const auto& there = values_of(far, n);
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const auto du0 = watch(m.guards[i], 1, here, n), du1 = watch(m.guards[i], 1, there, n);
        const auto need = a.curvature[i] * length + a.margin[i] / length;
        const mask_t<T> mine =
            going & v.past & (v.contact == static_cast<double>(i)) & (v.side * (du0 + du1) > need);
        hit.found = hit.found | mine;
        hit.contact = select(mine, v.contact, hit.contact);
        hit.side = select(mine, v.side, hit.side);
        hit.length = select(mine, length, hit.length);
        hit.u0 = select(mine, a.u[i], hit.u0);
        hit.du0 = select(mine, du0, hit.du0);
        hit.u1 = select(mine, v.u[i], hit.u1);
        hit.du1 = select(mine, du1, hit.du1);
        select_state(mine, hit.y, far, n);
    }
}

enum class stride { leap, step, creep }; // long, ordinary, short

// Strides of one length: on while they are clear, to the end where one lands. A creep that does
// neither gives up.
template <stride Kind, class T, class Mode, class Shape>
VI_HD inline void march(const Mode& m, const typename Mode::flow_type::propagator& e,
                        const real_t<T>& length, const real_t<T>& horizon, approach<T, Shape>& a,
                        crossing<T, Shape>& hit) {
    const int n = m.flow.dimension();
    constexpr int most = Kind == stride::creep ? most_creeps : most_strides;
    corridor<real_t<T>> free[Shape::max_contacts];
    for (int i = 0; i < m.flow.contacts(); ++i)
        free[i] = between_stops(m.guards[i], a.curvature[i], a.margin[i], length);
    mask_t<T> going = a.active;
    for (int strides = 0; strides < most; ++strides) {
        if constexpr (Kind == stride::leap) going = going & promising(m, a, length);
        going = going & (a.t + length <= horizon);
        if (!any(going)) return;
        const auto far = m.flow.apply(e, a.y);
        const auto v = judge(m, a, free, values_of(far, n));
        if constexpr (Kind != stride::leap) {
            if (any(going & v.past)) {
                record(m, a, far, v, going, length, hit);
                a.active = a.active & !hit.found;
            }
        }
        if constexpr (Kind == stride::creep) a.active = a.active & (v.clear | !going);
        going = going & v.clear;
        if (!any(going)) return;
        select_state(going, a.y, far, n);
        a.t = select(going, a.t + length, a.t);
        for (int i = 0; i < m.flow.contacts(); ++i)
            a.u[i] = select(going, v.u[i], a.u[i]);
    }
}

// Where in (0, 1) a function with end values g0 > 0 > g1 and end slopes d0, d1 < 0 vanishes: the
// cubic with the inverse function's values and slopes, then Newton's method on the cubic with g's.
template <class R>
VI_HD inline R crossing_point(const R& g0, const R& g1, const R& d0, const R& d1) {
    const R rise = g1 - g0;
    const R t = -g0 / rise, rest = 1.0 - t;
    const R x = t * (t * (3.0 - 2.0 * t) + rest * (rest * (rise / d0) - t * (rise / d1)));
    const R c2 = 3.0 * rise - (2.0 * d0 + d1), c3 = (d0 + d1) - 2.0 * rise;
    const R g = g0 + x * (d0 + x * (c2 + x * c3));
    const R slope = d0 + x * (2.0 * c2 + x * (3.0 * c3));
    return min(max(x - g / slope, R(0.0)), R(1.0));
}

// Where a gap with derivatives d vanishes: the inverse series in e = -g / g', to its fourth power.
template <class T>
VI_HD inline T nearby_root(const vec<T, 5>& d) {
    const T scale = 1.0 / d[1];
    const T e = -(d[0] * scale);
    const T a = d[2] * scale * 0.5, b = d[3] * scale * (1.0 / 6), c = d[4] * scale * (1.0 / 24);
    const T third = 2.0 * a * a - b;
    const T fourth = a * (5.0 * b - 5.0 * a * a) - c;
    return e * (1.0 + e * (e * (third + e * fourth) - a));
}

// The time of the crossing after the beginning of its stride, to a few thousandths of a stride.
template <class T, class Mode, class Shape>
VI_HD inline real_t<T> predict(const Mode& m, const crossing<T, Shape>& hit) {
    real_t<T> limit = real_t<T>(0.0);
    for (int i = 0; i < m.flow.contacts(); ++i)
        limit = select(hit.contact == static_cast<double>(i),
                       select(hit.side > 0.0, m.guards[i].upper, m.guards[i].lower), limit);
    const auto inwards = -hit.side * hit.length;
    return hit.length * crossing_point(hit.side * (limit - hit.u0), hit.side * (limit - hit.u1),
                                       inwards * hit.du0, inwards * hit.du1);
}

// A derivative of the gap on the side of the crossing.
template <class T, class Mode, class Shape>
VI_HD inline T gap_at(const Mode& m, int order, const vec<T, Shape::max_dimension>& y,
                      const crossing<T, Shape>& hit) {
    T gap = T(0.0);
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const auto limit = select(hit.side > 0.0, m.guards[i].upper, m.guards[i].lower);
        const T u = watch(m.guards[i], order, y, m.flow.dimension());
        const T mine = order == 0 ? hit.side * (limit - u) : -hit.side * u;
        gap = select(hit.contact == static_cast<double>(i), mine, gap);
    }
    return gap;
}

// The rate of a gap with derivatives d by its series, which need not wait for the state there.
template <class T>
VI_HD inline T slope(const vec<T, 5>& d, const T& x) {
    return d[1] + x * (d[2] + x * (d[3] * 0.5 + x * (d[4] * (1.0 / 6))));
}

// Series cut off cost jets some digits of their derivatives: dt = -dg / g' again, exactly.
template <class T, class Mode, class Shape>
VI_HD inline void sharpen(const Mode& m, const crossing<T, Shape>& hit,
                          stride_landing<T, Shape>& at) {
    const T shift = with_value(-gap_at(m, 0, at.y, hit) / value(at.rate), real_t<T>(0.0));
    at.y = m.flow.template short_flight<3>(at.y, shift);
    at.duration = at.duration + shift;
    at.rate = with_value(gap_at(m, 1, at.y, hit), value(at.rate));
}

template <class T, class Mode, class Shape>
VI_HD inline stride_landing<T, Shape> land(const Mode& m, const approach<T, Shape>& a,
                                           const crossing<T, Shape>& hit) {
    using R = real_t<T>;
    const auto& flow = m.flow;
    const R s = predict(m, hit);
    const mask_t<T> late = s > 0.5 * hit.length;
    auto nearer = a.y;
    select_state(late, nearer, hit.y, flow.dimension());
    const auto y = flow.template short_flight<march_order>(nearer, select(late, s - hit.length, s));
    vec<T, 5> gap{};
    for (int order = 0; order < 5; ++order)
        gap[order] = gap_at(m, order, y, hit);
    const T correction = nearby_root(gap);
    const R end = s + value(correction);
    const mask_t<T> inside = (end >= 0.0) & (end <= hit.length);
    const mask_t<T> close = (abs(value(correction)) <= largest_correction * flow.step) &
                            (abs(value(gap[2] * correction)) <= flattest * abs(value(gap[1])));
    const mask_t<T> proved = hit.found & inside & close;
    const auto landed = flow.template short_flight<landing_order>(y, correction);
    stride_landing<T, Shape> out{
        proved, hit.contact, hit.side, (a.t + s) + correction, slope(gap, correction), landed};
    if constexpr (scalar_traits<T>::is_jet) sharpen(m, hit, out);
    return out;
}

} // namespace detail

template <class T, class Mode, class Shape>
VI_HD inline stride_landing<T, Shape>
stride_flight(const Mode& m, const trajectory<T, Shape>& start, const real_t<T>& horizon) {
    using detail::stride;
    const auto& flow = m.flow;
    const auto leap = flow.step * static_cast<double>(leap_steps), creep = flow.step * creep_steps;
    auto a = detail::depart(m, start);
    detail::crossing<T, Shape> hit{a.t != a.t, 0.0, 1.0, a.t, a.t, a.t, a.t, a.t, start.y};
    for (int round = 0; round < most_rounds && any(a.active); ++round) {
        detail::march<stride::leap>(m, flow.leap, leap, horizon, a, hit);
        detail::march<stride::step>(m, flow.once, flow.step, horizon, a, hit);
        detail::march<stride::creep>(m, flow.creep, creep, horizon, a, hit);
    }
    if (!any(hit.found)) return {hit.found, {}, {}, {}, {}, {}};
    return detail::land(m, a, hit);
}

} // namespace vi
