// Rest on a stop: chatter completed, sticking begun, and what a release leaves behind.
//
// Method      A touching contact that leaves at rate v with gap acceleration a < 0 comes back after
//             2 v / |a|, leaving at R v, and so on: infinitely many impacts in
//                 t = 2 v / (|a| (1 - R))                                                  (1)
//             after which the relative motion is at rest. The sum is completed by a free flight of
//             length t and one plastic impact. No other contact may meet a stop meanwhile: with u^(m)
//             the derivatives of its u now, for s <= t
//                 |u(s) - u(0) - u' s| <= (s / t) sum |u^(m)| t^m / m!, m >= 2             (3)
//             and |u(s) - u(0)| <= the sum from m = 1 on.
//             Contacts at rest on their stops close or stay open as transition/closing.hpp says.
// Accuracy    (1) neglects the change of a, which moves the end velocity by about
//             v^2 |g'''| / (a (1 - R))^2, and lumps impulses, which moves positions by about
//             v^2 / (|a| (1 - R)^2): completed only where both are below 2^-53 of the motion (2),
//             and (1) is no longer than a step, as the flight and (3) are series
// Fails       sets of contacts whose mode was not built: rest_kind::missing, or stay_closed() is not 0;
//             their code is returned, and nothing was changed
// Reference   Nordmark, Piiroinen, Nonlinear Dynamics 58 (2009) 85-106; theory.md, "Chatter"
#pragma once

#include "vibroimpact/transition/closing.hpp"

namespace vi {

enum class rest_kind { none, chatter, stick, missing };

template <class T>
struct rest {
    rest_kind what;
    int contact; // where chatter was completed or sticking begun
    int code;    // of the closed set
    T duration;  // of the completed chatter
};

namespace detail {

// The first contact in a closed set that was not in it before, or -1.
VI_HD inline int newly_closed(int code, int before, int contacts) {
    for (int i = 0; i < contacts; ++i)
        if (side_in_code(code, i) != 0.0 && side_in_code(before, i) == 0.0) return i;
    return -1;
}

// (2)
template <class Flow, class State>
VI_HD inline bool chatter_is_summable(const hybrid<Flow>& system, const State& at, int i) {
    const double v = at.rate[i];
    const double r = restitution_at(system, i, at.touching[i]);
    const double a = gap_derivative<double>(system, at, i, 2);
    if (!(a < -rounding_of(system, at, i, 2)) || r >= 1.0) return false;
    const double jerk = abs(gap_derivative<double>(system, at, i, 3));
    const auto& mode = system.modes[at.mode];
    const double place = magnitude(mode.guards[i], 0, at.y, mode.flow) + mode.guards[i].reach;
    const double speed = magnitude(mode.guards[i], 1, at.y, mode.flow);
    const double lost = (1.0 - r) * (1.0 - r);
    return v * v * jerk <= unit_roundoff * speed * a * a * lost &&
           v * v <= unit_roundoff * place * -a * lost;
}

// Values of a jet trajectory, so that the tests above are the same for every scalar.
template <class T, class Shape>
VI_HD inline trajectory<double, Shape> values(const trajectory<T, Shape>& at, int n, int contacts) {
    trajectory<double, Shape> out{};
    out.mode = at.mode;
    out.held = at.held;
    out.elements = at.elements;
    for (int i = 0; i < n; ++i)
        out.y[i] = plain(at.y[i]);
    for (int i = 0; i < contacts; ++i) {
        out.touching[i] = plain(at.touching[i]);
        out.rate[i] = plain(at.rate[i]);
        out.flat[i] = plain(at.flat[i]);
    }
    return out;
}

// Values with all contacts that touch put on their stops exactly: forces that vanish there are read from these.
template <class T, class Flow>
VI_HD inline auto on_stops(const hybrid<Flow>& system,
                           const trajectory<T, typename Flow::shape_type>& at) {
    auto out = values(at, system.dimension(), system.contacts());
    set_on_stops(system, out);
    return out;
}

} // namespace detail

// The contacts of a code, at rest on their stops.
template <class T, class Flow>
VI_HD inline void touch_held(const hybrid<Flow>& system,
                             trajectory<T, typename Flow::shape_type>& at, int code) {
    for (int i = 0; i < system.contacts(); ++i) {
        const double side = detail::side_in_code(code, i);
        if (side == 0.0) continue;
        at.touching[i] = side;
        at.rate[i] = T(0.0);
    }
}

namespace detail {

// Duration (1) of the chatter of one contact.
template <class T, class Flow, class State>
VI_HD inline T chatter_time(const hybrid<Flow>& system, const State& at, int i) {
    const double r = restitution_at(system, i, plain(at.touching[i]));
    return 2.0 * at.rate[i] / (-gap_derivative<T>(system, at, i, 2) * (1.0 - r));
}

// (3): how far u of a contact moves in a time t at most, how far it turns off its tangent, and the
// rounding of u. It is lost where neither u nor any of the terms that add up to it moves by more.
struct small_motion {
    double moved, turned, rounding;
    bool lost;
};
template <class Flow, class State>
VI_HD inline small_motion motion_of(const hybrid<Flow>& system, const State& at, int j, double t) {
    const auto& mode = system.modes[at.mode];
    const auto& g = mode.guards[j];
    auto u = derivatives<taylor_order>(g, at.y, mode.flow);
    const double units = t / unit_of_time(mode.flow.step), moved = change_bound(u, units);
    const double terms = 2.0 * t * plain(magnitude(g, 1, at.y, mode.flow));
    const double rounding = rounding_of(system, at, j, 0) + 64.0 * unit_roundoff * g.reach;
    u.d[1] = 0.0;
    return {moved, change_bound(u, units), rounding, max(moved, terms) <= rounding / 64.0};
}

// Whether no element changes its state for a time t, as watches stay between their limits.
template <class Flow, class State>
VI_HD inline bool states_last(const hybrid<Flow>& system, const State& at, double t) {
    if constexpr (Flow::shape_type::max_watches > 0) {
        const auto& mode = system.modes[at.mode];
        for (int j = 0; j < mode.watched.count; ++j) {
            const auto& w = mode.watched.at[j];
            const auto& g = w.row;
            const auto u = derivatives<taylor_order>(g, at.y, mode.flow);
            const double moved = change_bound(u, t / unit_of_time(mode.flow.step));
            if (!w.held && !(min(g.upper - u.d[0], u.d[0] - g.lower) > moved)) return false;
        }
    }
    return true;
}

// Whether the constraints of the mode keep the gap of j, which impulses at i do not move.
template <class Flow, class State>
VI_HD inline bool stays_in_place(const hybrid<Flow>& system, const State& at, int i, int j) {
    return keeps_gap(system.modes[at.mode], j) && system.laws[i].mobility[j] == 0.0;
}

// Whether all other contacts stay away from their stops for a time t, or where they are, if it is so short
// that nothing moves beyond rounding.
template <class Flow, class State>
VI_HD inline bool others_stay_open(const hybrid<Flow>& system, const State& at, int chattering,
                                   double t) {
    for (int j = 0; j < system.contacts(); ++j) {
        if (j == chattering || side_in_code(at.held, j) != 0.0) continue;
        if (stays_in_place(system, at, chattering, j)) continue;
        const auto motion = motion_of(system, at, j, t);
        if (motion.lost) continue;
        if (at.touching[j] != 0.0) {
            if (!(at.rate[j] * t - motion.turned > 4.0 * motion.rounding)) return false;
            continue;
        }
        const auto& g = system.modes[at.mode].guards[j];
        const double u = guard_value(g, 0, at.y, system.dimension());
        if (min(g.upper - u, u - g.lower) <= motion.moved) return false;
    }
    return states_last(system, at, t);
}

// Bring contact i and those held to rest together; false if one would be pulled by more than the
// impulse that has pressed it meanwhile. Free coordinates.
template <class T, class Flow>
VI_HD inline bool rest_together(const hybrid<Flow>& system,
                                trajectory<T, typename Flow::shape_type>& at, int i,
                                const vec<double, Flow::max_contacts>& pressed) {
    constexpr int N = Flow::max_contacts;
    contact_list<N> list{};
    for (int j = 0; j < system.contacts(); ++j)
        if (j == i || side_in_code(at.held, j) != 0.0) list.add(j);
    const auto problem = mobilities_of(system, at, list);
    vec<T, N> b{}, p{};
    for (int k = 0; k < list.count; ++k)
        b[k] = at.rate[list.index[k]];
    const int all = (1 << list.count) - 1;
    vec<double, N> none{};
    if (!solve_active(problem, all, none)) return false;
    active_impulses(problem, all, b, p);
    for (int k = 0; k < list.count; ++k)
        if (plain(p[k]) < -pressed[list.index[k]]) return false;
    for (int j = 0; j < system.contacts(); ++j)
        if (at.touching[j] != 0.0) push_rate(system, at, j, list, p);
    for (int k = 0; k < list.count; ++k) {
        const int c = list.index[k];
        push_away(at.y, system.dimension(), system.laws[c], plain(at.touching[c]), p[k]);
    }
    return true;
}

// The sum (1): a flight in the present mode, then one plastic impact of the contact and those held.
// Each of its impulses may throw these off; they come back, and chatter too. All end it together where
// the force on those held makes up for that.
template <class T, class Flow>
VI_HD inline T sum_impacts(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at,
                           int i) {
    const auto& mode = system.modes[at.mode];
    const T t = chatter_time<T>(system, at, i);
    vec<double, Flow::max_contacts> pressed{}; // impulses
    for (int j = 0; j < system.contacts(); ++j) {
        if (side_in_code(at.held, j) != 0.0)
            pressed[j] = plain(t) * plain(guard_value(mode.guards[j], 0, at.y, system.dimension()));
        else if (j != i && !stays_in_place(system, at, i, j) &&
                 !motion_of(system, at, j, plain(t)).lost)
            at.touching[j] = 0.0; // it has left; the others are where they were
    }
    at.y = mode.flow.template short_flight<taylor_order>(at.y, t);
    leave_mode(system, at);
    at.flat = {};
    at.rate[i] = gap_derivative<T>(system, at, i, 1);
    touch_held(system, at, at.held);
    if (at.held != 0 && rest_together(system, at, i, pressed))
        touch_held(system, at, at.held);
    else
        resolve_impact(system, at, 0.0);
    at.rate[i] = T(0.0);
    return t;
}

} // namespace detail

// The first touching contact that is approached, or -1. A start given from outside can say so, or the impulses of
// an impact elsewhere: it strikes next, at the same instant.
template <class T, class Shape>
VI_HD inline int approached(const trajectory<T, Shape>& at, int contacts) {
    for (int i = 0; i < contacts; ++i)
        if (at.touching[i] != 0.0 && plain(at.rate[i]) < 0.0) return i;
    return -1;
}

namespace detail {

template <class T, class Shape>
VI_HD inline bool any_at_rest(const trajectory<T, Shape>& at, int contacts) {
    for (int i = 0; i < contacts; ++i)
        if (at.touching[i] != 0.0 && plain(at.rate[i]) == 0.0) return true;
    return false;
}

// Go over from free coordinates to the mode of the contacts that stay closed. Undecided: that mode, or
// one that is needed to decide, has this code and is missing, or is none (-1); nothing was
// changed.
template <class T, class Flow>
VI_HD inline closing enter_closed(const hybrid<Flow>& system,
                                  trajectory<T, typename Flow::shape_type>& at) {
    if (!any_at_rest(at, system.contacts())) {
        at.held = 0;
        return {0, true};
    }
    auto plain = on_stops(system, at);
    auto next = closed_set(system, plain);
    next.decided = next.decided && next.code >= 0 && enter_mode(system, at, next.code);
    if (next.decided)
        for (int i = 0; i < system.contacts(); ++i)
            at.flat[i] = plain.flat[i];
    return next;
}

} // namespace detail

// After an event elsewhere contacts held before may stay closed: the motion goes on in their mode,
// unless another impact or a contact that begins to press comes first. The answer is the code of a
// mode that has to be built before, or 0.
template <class T, class Flow>
VI_HD inline int stay_closed(const hybrid<Flow>& system,
                             trajectory<T, typename Flow::shape_type>& at) {
    const int contacts = system.contacts();
    if (!system.is_open(at.mode) || at.held == 0 || approached(at, contacts) >= 0) return 0;
    auto there = at;
    const auto next = detail::enter_closed(system, there);
    if (next.code < 0 || detail::newly_closed(next.code, at.held, contacts) >= 0) return 0;
    if (!next.decided) return mode_code(system, at, next.code);
    at = there;
    return 0;
}

// Before a flight: contacts at rest that are pressed close, and the motion goes on in their mode.
template <class T, class Flow>
VI_HD inline rest<T> begin_sticking(const hybrid<Flow>& system,
                                    trajectory<T, typename Flow::shape_type>& at) {
    if (system.is_open(at.mode)) {
        const int before = at.held;
        const auto next = detail::enter_closed(system, at);
        if (!next.decided)
            return {rest_kind::missing, -1, mode_code(system, at, next.code), T(0.0)};
        const int fresh = detail::newly_closed(next.code, before, system.contacts());
        if (fresh >= 0) return {rest_kind::stick, fresh, next.code, T(0.0)};
    }
    return {rest_kind::none, -1, 0, T(0.0)};
}

// Before a flight: the first contact whose bounces die out within the horizon and a step comes to rest.
template <class T, class Flow>
VI_HD inline rest<T> complete_chatter(const hybrid<Flow>& system,
                                      trajectory<T, typename Flow::shape_type>& at,
                                      double horizon) {
    const int contacts = system.contacts();
    const auto plain = detail::values(at, system.dimension(), contacts);
    for (int i = 0; i < contacts; ++i) {
        if (at.touching[i] == 0.0 || detail::side_in_code(at.held, i) != 0.0 ||
            !(plain.rate[i] > 0.0) || !detail::chatter_is_summable(system, plain, i))
            continue;
        const double t = detail::chatter_time<double>(system, plain, i);
        if (!(t <= min(horizon, system.modes[at.mode].flow.step)) ||
            !detail::others_stay_open(system, plain, i, t))
            continue;
        return {rest_kind::chatter, i, 0, detail::sum_impacts(system, at, i)};
    }
    return {rest_kind::none, -1, 0, T(0.0)};
}

} // namespace vi
