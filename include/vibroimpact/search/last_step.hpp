// The last step of a flight: onto the stop, from a state next to it.
//
// Method      With g the gap, computed anew at that state, and its rate g', e = -g / g':
//               s = e (1 - g'' e / (2 g'))                                               (1)
//             and the state follows by its series to second order.
// Accuracy    (1) is off by 2 (g'' s / (2 g'))^2 s: where the step is exact, less than 2^-52 steps; and by what g''
//             is off, times s^2 / (2 g'): where it is extrapolated from a sixteenth of a step, some 2^-46
// Reference   theory.md, (T16d)
#pragma once

#include "vibroimpact/search/grid/guards_scan.hpp"

namespace vi {

// Bounds of exact steps:
inline constexpr double largest_correction = 0x1p-18; // s, of a step of the flow
inline constexpr double flattest = 0x1p-18;           // g'' s / (2 g')

namespace detail {

// Whether the guard that is hit is one of many, to be found by its number.
template <class Mode, class R>
inline constexpr bool by_number = is_same<R, double> && Mode::flow_type::several_may_cross;

// value_of(guard) of the contact that hits.
template <class T, class Mode, class R, class Value>
VI_HOT T value_at_hit(const Mode& m, const stop_hit<R>& hit, const Value& value_of) {
    if constexpr (by_number<Mode, R>) return value_of(m.guards[static_cast<int>(hit.contact)]);
    T u = value_of(m.guards[0]);
    for (int i = 1; i < m.flow.contacts(); ++i)
        u = select(hit.contact == static_cast<double>(i), value_of(m.guards[i]), u);
    return u;
}

// Distance to the limit, in u; and u'.
template <class T, class Mode, class R, int D>
VI_HOT T left_to(const Mode& m, const vec<T, D>& y, const stop_hit<R>& hit) {
    return hit.limit - value_at_hit<T>(m, hit, [&](const auto& g) VI_WITHIN {
               return guard_distance(g, y, m.flow);
           });
}
template <class T, class Mode, class R, int D>
VI_HOT T speed_at(const Mode& m, const vec<T, D>& y, const stop_hit<R>& hit) {
    return value_at_hit<T>(m, hit,
                           [&](const auto& g) VI_WITHIN { return guard_speed(g, y, m.flow); });
}

template <class T, class Mode, class R, int D>
VI_HOT T bend_at(const Mode& m, const vec<T, D>& y, const stop_hit<R>& hit) {
    return value_at_hit<T>(m, hit,
                           [&](const auto& g) VI_WITHIN { return guard_bend(g, y, m.flow); });
}

// Distance to the limit, and the next Taylor coefficients of u.
template <class R>
struct expansion {
    R left, slope, bend, twist;
};
template <class R, class Mode, int D>
VI_HOT expansion<R> expand_hit(const Mode& m, const vec<R, D>& y, const stop_hit<R>& hit) {
    int first = 0;
    if constexpr (by_number<Mode, R>) first = static_cast<int>(hit.contact);
    auto u = expand(m.guards[first], y, m.flow);
    for (int i = 1; !by_number<Mode, R> && i < m.flow.contacts(); ++i) {
        const auto other = expand(m.guards[i], y, m.flow);
        const mask_t<R> mine = hit.contact == static_cast<double>(i);
        for (int k = 0; k < 4; ++k)
            u[k] = select(mine, other[k], u[k]);
    }
    return {hit.limit - u[0], u[1], u[2], u[3]};
}

// (1); scale = 1 / u'.
template <class R>
struct last_step {
    R shift;
    mask_t<R> exact;
    VI_HOT last_step(const R& left, const R& bend, const R& scale, const R& step) {
        const R miss = left * scale, turn = bend * scale;
        shift = miss * fnma(turn, miss, 1.0);
        exact = (abs(shift) <= largest_correction * step) & (abs(turn * shift) <= flattest);
    }
};

} // namespace detail
} // namespace vi
