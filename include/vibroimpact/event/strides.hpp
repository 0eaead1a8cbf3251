// The common flight, at the speed of a few multiply-adds per stride: all lanes at once.
//
// Method      From a free start the state takes long strides (leaps), then steps, then short strides
//             (creeps) past a stop that is near, each a stored propagator, as long as they are proved
//             clear of the stops, and so on in rounds; no elementary function is called. With M >= |u''| over the flight and 0, 1 the ends of a
//             stride h (theory T-chord):
//               u stays below the upper limit if  u0 + u1 < 2 upper - M h^2 / 2 and u1 < upper   (1)
//               (an interior maximum exceeds the mean of the ends by at most M h^2 / 4), and
//               likewise above the lower one. On a stop u0 is that limit exactly.
//               u crosses once if u1 is past the limit and u0' + u1' > M h                       (2)
//             M: each block's share w of u has w' a solution of the homogeneous equation, whose
//             energy decays, so |w''| <= sqrt(w''(0)^2 + k w'(0)^2).                             (3)
//             The root: the inverse of u as a cubic through both ends and slopes, one Newton step
//             on the direct cubic, a Taylor flight there from the nearer end, Newton's method on
//             the local quartic.
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
    vec<real, Shape::max_contacts> u, du;
    vec<real, Shape::max_contacts> curvature, margin;
};

// The stride in which it lands: from where the approach stands to y, where the contact sees u, du.
template <class T, class Shape>
struct crossing {
    using real = real_t<T>;
    mask_t<T> found;
    real contact, side, length, u, du;
    vec<T, Shape::max_dimension> y;
};

template <class R, int N>
struct sight {
    vec<R, N> u, du;
};

template <Real R, int D>
VI_HD inline const vec<R, D>& values_of(const vec<R, D>& y, int) {
    return y;
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

// What a contact knows of a flight from its start: u', the bound M, the size of the terms of u.
template <class R>
struct outlook {
    R du, curvature, terms;
};
template <class R, int D, int Orders, class Flow>
VI_HD inline outlook<R> look_out(const guard<R, D, Orders>& g, const Flow& flow,
                                 const vec<R, D>& y) {
    outlook<R> o{R(0.0), R(0.0), R(0.0)};
    const auto share = [&](int order, int j) { // of block j in u^(order)
        return g.rows[order][2 * j] * y[2 * j] + g.rows[order][2 * j + 1] * y[2 * j + 1];
    };
    for (int j = 0; j < flow.blocks(); ++j) {
        const R w1 = share(1, j) + g.rows[0][2 * j + 1] * flow.a[j];
        const R w2 = share(2, j) + g.rows[1][2 * j + 1] * flow.a[j];
        o.du = o.du + w1;
        o.curvature = o.curvature + sqrt(w2 * w2 + flow.k[j] * (w1 * w1)); // (3)
        o.terms = o.terms + (abs(g.rows[0][2 * j] * y[2 * j]) +
                             abs(g.rows[0][2 * j + 1] * y[2 * j + 1]) + flow.step * abs(w1));
    }
    return o;
}

// Slow departures are not for this path: below this rate chatter may have to be summed.
template <class R, class G>
VI_HD inline R slow_rate_squared(const G& g, const R& curvature, const R& terms) {
    return 8.0 * unit_roundoff * curvature * (terms + g.reach);
}

template <class T, class Mode, class Shape>
VI_HD inline approach<T, Shape> depart(const Mode& m, const trajectory<T, Shape>& start) {
    using R = real_t<T>;
    const int n = m.flow.dimension();
    const auto z = values_of(start.y, n);
    approach<T, Shape> a{start.y, R(0.0), R(0.0) == R(0.0), {}, {}, {}, {}};
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const auto& g = m.guards[i];
        const auto o = look_out(g, m.flow, z);
        const R side = start.touching[i], rate = value(start.rate[i]);
        a.u[i] = select(side > 0.0, g.upper, select(side < 0.0, g.lower, watch(g, 0, z, n)));
        a.du[i] = o.du;
        a.curvature[i] = o.curvature;
        a.margin[i] = proof_margin * (o.terms + g.reach);
        const R slow = slow_rate_squared(g, o.curvature, o.terms);
        a.active = a.active & ((side == 0.0) | ((rate > 0.0) & (rate * rate > slow)));
    }
    return a;
}

template <class R, class Mode, int D>
VI_HD inline sight<R, Mode::flow_type::max_contacts> look(const Mode& m, const vec<R, D>& z) {
    sight<R, Mode::flow_type::max_contacts> s{};
    for (int i = 0; i < m.flow.contacts(); ++i) {
        s.u[i] = watch(m.guards[i], 0, z, m.flow.dimension());
        s.du[i] = watch(m.guards[i], 1, z, m.flow.dimension());
    }
    return s;
}

// A leap is tried where its straight continuation stays inside; whether it is clear (1) decides.
template <class T, class Mode, class Shape>
VI_HD inline mask_t<T> promising(const Mode& m, const approach<T, Shape>& a,
                                 const real_t<T>& length) {
    mask_t<T> inside = a.active;
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const auto ahead = a.u[i] + a.du[i] * length;
        inside = inside & (ahead < m.guards[i].upper) & (ahead > m.guards[i].lower);
    }
    return inside;
}

template <class R>
struct verdict {
    mask_t<R> clear, lands; // (1) for every contact; (2) for one, and (1) for the others
    R contact, side;        // where it lands
};

template <class T, class Mode, class Shape>
VI_HD inline verdict<real_t<T>> judge(const Mode& m, const approach<T, Shape>& a,
                                      const sight<real_t<T>, Shape::max_contacts>& end,
                                      const real_t<T>& h) {
    using R = real_t<T>;
    const mask_t<T> no = R(0.0) != R(0.0);
    verdict<R> v{!no, no, R(0.0), R(1.0)};
    mask_t<T> several = no;
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const auto& g = m.guards[i];
        const R bulge = 0.5 * a.curvature[i] * (h * h) + a.margin[i];
        const R need = a.curvature[i] * h + a.margin[i];
        const R ends = a.u[i] + end.u[i], slopes = a.du[i] + end.du[i];
        const mask_t<T> below = (ends < 2.0 * g.upper - bulge) & (end.u[i] < g.upper - a.margin[i]);
        const mask_t<T> above = (ends > 2.0 * g.lower + bulge) & (end.u[i] > g.lower + a.margin[i]);
        const mask_t<T> up = above & (end.u[i] > g.upper) & (slopes > need);
        const mask_t<T> down = below & (end.u[i] < g.lower) & (slopes < -need);
        const mask_t<T> crosses = up | down, clear = below & above;
        several = several | (!v.clear & !clear);
        v.clear = v.clear & clear;
        v.lands = v.lands | crosses;
        v.contact = select(crosses, R(static_cast<double>(i)), v.contact);
        v.side = select(down, R(-1.0), v.side);
    }
    v.lands = v.lands & !several;
    return v;
}

template <class T, class Shape>
VI_HD inline void record(const vec<T, Shape::max_dimension>& far,
                         const sight<real_t<T>, Shape::max_contacts>& end, int n, int contacts,
                         const verdict<real_t<T>>& v, const mask_t<T>& found,
                         const real_t<T>& length, crossing<T, Shape>& hit) {
    hit.found = hit.found | found;
    hit.contact = select(found, v.contact, hit.contact);
    hit.side = select(found, v.side, hit.side);
    hit.length = select(found, length, hit.length);
    select_state(found, hit.y, far, n);
    for (int i = 0; i < contacts; ++i) {
        const mask_t<T> mine = found & (v.contact == static_cast<double>(i));
        hit.u = select(mine, end.u[i], hit.u);
        hit.du = select(mine, end.du[i], hit.du);
    }
}

enum class stride { leap, step, creep };

// Strides of one length: on while they are clear, to the end where one lands.
template <stride Kind, class T, class Mode, class Shape>
VI_HD inline void march(const Mode& m, const typename Mode::flow_type::propagator& e,
                        const real_t<T>& length, const real_t<T>& horizon, approach<T, Shape>& a,
                        crossing<T, Shape>& hit) {
    const int n = m.flow.dimension();
    mask_t<T> going = a.active;
    for (int strides = 0; strides < (Kind == stride::creep ? most_creeps : most_strides); ++strides) {
        if constexpr (Kind == stride::leap) going = going & promising(m, a, length);
        going = going & (a.t + length <= horizon);
        if (!any(going)) return;
        const auto far = m.flow.apply(e, a.y);
        const auto end = look(m, values_of(far, n));
        const auto v = judge(m, a, end, length);
        if constexpr (Kind != stride::leap) {
            const mask_t<T> found = going & v.lands;
            if (any(found)) record(far, end, n, m.flow.contacts(), v, found, length, hit);
            a.active = a.active & !found;
        }
        if constexpr (Kind == stride::creep) a.active = a.active & (v.clear | !going); // given up
        going = going & v.clear;
        if (!any(going)) return;
        select_state(going, a.y, far, n);
        a.t = select(going, a.t + length, a.t);
        for (int i = 0; i < m.flow.contacts(); ++i) {
            a.u[i] = select(going, end.u[i], a.u[i]);
            a.du[i] = select(going, end.du[i], a.du[i]);
        }
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

// The Taylor polynomial of a gap from its derivatives d, and its slope.
template <class T>
VI_HD inline T quartic(const T (&d)[5], const T& x) {
    const T high = d[2] * 0.5 + x * (d[3] * (1.0 / 6) + x * (d[4] * (1.0 / 24)));
    return d[0] + x * (d[1] + x * high);
}
template <class T>
VI_HD inline T quartic_slope(const T (&d)[5], const T& x) {
    return d[1] + x * (d[2] + x * (d[3] * 0.5 + x * (d[4] * (1.0 / 6))));
}

// Its root near 0: two terms of the inverse series, then Newton's method.
template <class T>
VI_HD inline T quartic_root(const T (&d)[5]) {
    const T first = -d[0] / d[1];
    const T x = first - 0.5 * (d[2] / d[1]) * (first * first);
    return x - quartic(d, x) / quartic_slope(d, x);
}

// The time of the crossing after the beginning of its stride, to a few thousandths of a stride.
template <class T, class Mode, class Shape>
VI_HD inline real_t<T> predict(const Mode& m, const approach<T, Shape>& a,
                               const crossing<T, Shape>& hit) {
    using R = real_t<T>;
    R u = R(0.0), du = R(0.0), limit = R(0.0);
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const mask_t<T> mine = hit.contact == static_cast<double>(i);
        u = select(mine, a.u[i], u);
        du = select(mine, a.du[i], du);
        limit = select(mine, select(hit.side > 0.0, m.guards[i].upper, m.guards[i].lower), limit);
    }
    const R inwards = -hit.side * hit.length;
    return hit.length * crossing_point(hit.side * (limit - u), hit.side * (limit - hit.u),
                                       inwards * du, inwards * hit.du);
}

// The gap on the side of the crossing and its derivatives.
template <class T>
struct gap_derivatives {
    T d[5];
};
template <class T, class Mode, class Shape>
VI_HD inline gap_derivatives<T> gap_at(const Mode& m, const vec<T, Shape::max_dimension>& y,
                                       const crossing<T, Shape>& hit) {
    gap_derivatives<T> g{};
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const mask_t<T> mine = hit.contact == static_cast<double>(i);
        const auto limit = select(hit.side > 0.0, m.guards[i].upper, m.guards[i].lower);
        for (int order = 0; order < 5; ++order) {
            const T u = watch(m.guards[i], order, y, m.flow.dimension());
            const T gap = order == 0 ? hit.side * (limit - u) : -hit.side * u;
            g.d[order] = select(mine, gap, g.d[order]);
        }
    }
    return g;
}

template <class T, class Mode, class Shape>
VI_HD inline stride_landing<T, Shape> land(const Mode& m, const approach<T, Shape>& a,
                                           const crossing<T, Shape>& hit) {
    const auto& flow = m.flow;
    const auto s = predict(m, a, hit);
    const mask_t<T> late = s > 0.5 * hit.length;
    auto nearer = a.y;
    select_state(late, nearer, hit.y, flow.dimension());
    const auto y = flow.template short_flight<march_order>(nearer, select(late, s - hit.length, s));
    const auto gap = gap_at(m, y, hit);
    const T correction = quartic_root(gap.d);
    const mask_t<T> close = abs(value(correction)) <= largest_correction * flow.step;
    return {mask_t<T>(hit.found & close), hit.contact, hit.side, (a.t + s) + correction,
            quartic_slope(gap.d, correction),
            flow.template short_flight<landing_order>(y, correction)};
}

} // namespace detail

template <class T, class Mode, class Shape>
VI_HD inline stride_landing<T, Shape> stride_flight(const Mode& m,
                                                    const trajectory<T, Shape>& start,
                                                    const real_t<T>& horizon) {
    using detail::stride;
    const auto& flow = m.flow;
    const auto leap = flow.step * static_cast<double>(leap_steps), creep = flow.step * creep_steps;
    auto a = detail::depart(m, start);
    detail::crossing<T, Shape> hit{};
    hit.found = a.t != a.t;
    for (int round = 0; round < most_rounds && any(a.active); ++round) {
        detail::march<stride::leap>(m, flow.leap, leap, horizon, a, hit);
        detail::march<stride::step>(m, flow.once, flow.step, horizon, a, hit);
        detail::march<stride::creep>(m, flow.creep, creep, horizon, a, hit);
    }
    if (!any(hit.found)) return {hit.found, {}, {}, {}, {}, {}};
    return detail::land(m, a, hit);
}

} // namespace vi
