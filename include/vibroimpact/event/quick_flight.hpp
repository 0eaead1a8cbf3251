// The common flight, at the speed of a few hundred multiply-adds: all lanes at once.
//
// Method      From a free start the state goes on from grid to grid (event/lookahead.hpp), wide ones
//             while they are clear, narrow ones past a stop that is near, to the interval in which
//             it lands. Each is one stored propagator; no elementary function is called.
//             The root: predicted by the parabola through three times of the grid; one stored
//             propagator to the part of a step next to it; there the inverse series of the gap,  (1)
//             and from its value one step of third order with the gap's Taylor polynomial.       (2)
//             Whatever is not proved this way (several contacts in an interval, slow departure, a
//             near graze, the horizon) is left to certified_flight, from the start of the flight.
// Assumes     the free mode of a modal flow, k >= 0, c >= 0; touching contacts leave: rate >= 0
// Accuracy    state: 4 ulp of the amplitude per propagator, at most 130; time: the same divided by
//             the rate
// Reference   theory.md, "First contact"
#pragma once

#include "vibroimpact/event/lookahead.hpp"

namespace vi {

inline constexpr int most_rounds = 64; // of a wide grid and a narrow one
inline constexpr int quick_orders = 7; // (7/10 / 32)^8 / 8! < 2^-59: of a gap over `longest_part`
inline constexpr double longest_part = 1.0 / 32; // of a step, from a stored part to the root
// With c what (2) adds to (1): (2) is off by 2 (g'' c / 2 g')^2 c, less than 2^-52 steps.
inline constexpr double largest_correction = 0x1p-18; // c, of a step
inline constexpr double flattest = 0x1p-18;           // g'' c / 2 g'
inline constexpr int most_tries = 2;                  // more, to find the root from a better guess
static_assert(quick_orders + 1 == grid_times);

template <class T, class Shape>
struct quick_landing {
    using real = real_t<T>;
    mask_t<T> proved;
    real contact, side;
    T duration, rate;
    vec<T, Shape::max_dimension> y;
};

namespace detail {

// Where in (0, 1) the parabola through g0 > 0 > g1, g2 at 0, 1, 2 vanishes: x = -g0 / rise +
// bend x (1 - x), to second order in bend.
template <class R>
VI_HOT R crossing_point(const R& g0, const R& g1, const R& g2) {
    const R rise = g1 - g0, scale = 1.0 / rise;
    const R x = -(g0 * scale), bend = 0.5 * ((g2 - g1) - rise) * scale;
    return x + bend * (x * (1.0 - x)) * (1.0 + bend * (1.0 - 2.0 * x));
}

// A derivative of the gap on the side of the crossing.
template <class T, class Mode, class R, int D>
VI_HOT T gap_at(const Mode& m, int order, const vec<T, D>& y, const crossing<R>& hit) {
    T gap = T(0.0);
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const T u = watch(m.guards[i], order, y, m.flow.dimension());
        const T mine = order == 0 ? hit.side * (hit.limit - u) : -hit.side * u;
        gap = i == 0 ? mine : select(hit.contact == static_cast<double>(i), mine, gap);
    }
    return gap;
}

// The Taylor coefficients of the gap on the side of the crossing.
template <class R, class Mode, int D>
VI_HOT vec<R, grid_times> expand_gap(const Mode& m, const vec<R, D>& y, const crossing<R>& hit) {
    vec<R, grid_times> gap;
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const auto u = watch_all(m.guards[i].expansion, y, m.flow.dimension());
        const mask_t<R> mine = hit.contact == static_cast<double>(i);
        for (int k = 0; k < grid_times; ++k)
            gap[k] = i == 0 ? u[k] : select(mine, u[k], gap[k]);
    }
    gap[0] = gap[0] - hit.limit;
    for (int k = 0; k < grid_times; ++k)
        gap[k] = -hit.side * gap[k];
    return gap;
}

// (1) to its third power.
template <class R>
VI_HOT R nearby_root(const vec<R, grid_times>& g) {
    const R scale = 1.0 / g[1];
    const R e = -(g[0] * scale), a = g[2] * scale, b = g[3] * scale;
    return e * (1.0 - e * (a - e * (2.0 * a * a - b)));
}

template <class R>
VI_HOT R sum_of(const vec<R, grid_times>& g, const R& s) {
    const R s2 = s * s;
    const R low = (g[0] + g[1] * s) + s2 * (g[2] + g[3] * s);
    const R high = (g[4] + g[5] * s) + s2 * (g[6] + g[7] * s);
    return low + (s2 * s2) * high;
}
template <class R>
VI_HOT R slope_of(const vec<R, grid_times>& g, const R& s) {
    const R s2 = s * s;
    const R low = (g[1] + (2.0 * g[2]) * s) + s2 * (3.0 * g[3] + (4.0 * g[4]) * s);
    const R high = (5.0 * g[5] + (6.0 * g[6]) * s) + s2 * (7.0 * g[7]);
    return low + (s2 * s2) * high;
}

// Series cut off cost jets some digits of their derivatives: dt = -dg / g' again, exactly.
template <class T, class Mode, class Shape>
VI_HOT void sharpen(const Mode& m, const crossing<real_t<T>>& hit, quick_landing<T, Shape>& at) {
    const T shift = with_value(-gap_at(m, 0, at.y, hit) / value(at.rate), real_t<T>(0.0));
    at.y = m.flow.template short_flight<3>(at.y, shift);
    at.duration = at.duration + shift;
    at.rate = with_value(gap_at(m, 1, at.y, hit), value(at.rate));
}

// The root s beyond a state that is near to it, and whether it is found to rounding.
template <class R>
struct polished {
    R s;
    mask_t<R> close;
};
template <class R>
VI_HOT polished<R> polish(const vec<R, grid_times>& gap, const R& step) {
    const R s = nearby_root(gap), slope = slope_of(gap, s), scale = 1.0 / slope;
    const R miss = -(sum_of(gap, s) * scale), bend = gap[2] + (3.0 * gap[3]) * s;
    const R correction = miss * (1.0 - bend * scale * miss); // (2)
    const mask_t<R> close = (abs(s) <= longest_part * step) &
                            (abs(correction) <= largest_correction * step) &
                            (abs(bend * correction) <= flattest * abs(slope));
    return {s + correction, close};
}

template <class T, class Mode, class Shape>
VI_HOT quick_landing<T, Shape> land(const Mode& m, const approach<T, Shape>& a,
                                    const crossing<real_t<T>>& hit) {
    using R = real_t<T>;
    const auto& flow = m.flow;
    const int n = flow.dimension();
    const auto part = flow.step * (1.0 / parts_of_step);
    R guess = hit.length * crossing_point(hit.side * (hit.limit - hit.u0),
                                          hit.side * (hit.limit - hit.u1),
                                          hit.side * (hit.limit - hit.u2));
    for (int tries = 0;; ++tries) {
        const auto at = nearest_place(guess * (1.0 / part), parts_of_step);
        const auto near = flow.apply(flow.part, at, a.y);
        const auto root = polish(expand_gap(m, values_of(near, n), hit), R(flow.step));
        const R from = as_real<R>(at) * part, end = from + root.s;
        if (tries == most_tries || !any(hit.found & !root.close)) {
            const auto y = flow.template short_flight<quick_orders>(near, root.s);
            const mask_t<T> proved = hit.found & root.close & (end >= 0.0) & (end <= hit.length);
            quick_landing<T, Shape> out{
                proved, hit.contact, hit.side, (a.t + from) + root.s, gap_at(m, 1, y, hit), y};
            if constexpr (scalar_traits<T>::is_jet) sharpen(m, hit, out);
            return out;
        }
        guess = select(root.close, guess, end);
    }
}

} // namespace detail

template <class T, class Mode, class Shape>
VI_HOT quick_landing<T, Shape> quick_flight(const Mode& m, const trajectory<T, Shape>& start,
                                            const real_t<T>& horizon) {
    using R = real_t<T>;
    auto a = detail::depart(m, start);
    detail::crossing<R> hit{a.t != a.t, a.t, a.t, a.t, a.t, a.t, a.t, a.t};
    const auto widest = m.flow.step * (grid_steps[0] * grid_times);
    for (int round = 0; round < most_rounds; ++round) {
        a.active = a.active & (a.t + widest <= horizon);
        if (!any(a.active & !hit.found)) break;
        auto stuck = detail::look_ahead<0>(m, a.active & !hit.found, a, hit);
        if (any(stuck)) stuck = detail::look_ahead<1>(m, stuck, a, hit);
        a.active = a.active & !stuck;
    }
    if (!any(hit.found)) return {hit.found, {}, {}, {}, {}, {}};
    return detail::land(m, a, hit);
}

} // namespace vi
