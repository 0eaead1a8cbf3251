// Transitions: what the end of a flight on a guard does to the motion, and what rest on a stop does before it.
//
// Method      A transition is chosen by the guard that is hit and by the mode the motion is in. It changes
//             the state, decides the mode in which the motion goes on, and is reported by a status:
//
//             mode      guard             transition                            status
//             free      gap, crossed      impact law; several contacts at once  impact, simultaneous
//             any       gap, touched      none: the flight goes on              grazing
//             sticking  contact force     the contact opens; free coordinates   release
//             free      gap, at rest      the contact closes; mode of the set   stick
//             any       gap, bounces      infinitely many impacts at once       chatter
//
//             cross_guard()     after a flight: the first three rows
//             impact_at_once()  a touching contact that is approached: no flight lies between
//             before_flight()   the last two rows
//             impact_of_round() the first row, in every lane whose round landed (quick_flight.hpp)
//             A mode that was not built is reported as missing_mode, and nothing was changed.
// Assumes     at.touching, at.rate and at.flat as certified_flight.hpp says; between the calls at.mode
//             and at.held agree
// Accuracy    one impact: three roundings; velocities of touching contacts exactly as the law gives them
// Fails       undecided: the impact law has no solution, or the search did not finish
// Reference   transition/impact_law.hpp, rest.hpp, closing.hpp; theory.md, sections 4 to 6
#pragma once

#include "vibroimpact/search/grid/quick_flight.hpp"
#include "vibroimpact/transition/rest.hpp"

namespace vi {

enum class status : int {
    impact = 0,
    grazing = 1,       // a gap touched zero within rounding: no impulse
    chatter = 2,       // infinitely many impacts summed; the contact is at rest afterwards
    stick = 3,         // a contact begins to press
    release = 4,       // its force has fallen to zero
    simultaneous = 5,  // an impact that moves several touching contacts
    horizon = 6,       // no event up to the given time; from here on no event at all
    undecided = 7,     // the search could not be finished: an error, never silence
    diverged = 8,      // the state is so large that nothing can be decided
    steps = 9,         // the search took more steps than are allowed
    missing_mode = 10, // a set of closed contacts whose mode the host has to build
    paused = 11,       // none yet, within step(): the quick flight may go on
    searching = 12,    // none yet after many steps: time to ask whether to go on
    engage = 13,       // a soft stop is met: an impact without impulse
    change = 14,     // an element takes another state: friction sticks or slips, a soft stop opens
    non_unique = 15, // the same, where other states could have lasted, too
};

// Whether it is an event of the motion, and not the end of a search.
VI_HD constexpr bool moves_on(status what) {
    return what < status::horizon || what >= status::engage;
}

template <class T, class Shape>
struct event {
    status what;
    int contact, side;
    int wanted = 0;       // code of the mode that is missing, for missing_mode
    int applications = 0; // of propagators in the flight so far, where there is no event yet
    int examined = 0;     // steps of the flight that were examined
    T duration;           // since the previous event
    T rate_before, rate_after;
    vec<T, Shape::max_dimension> before; // free coordinates just before the jump
};

namespace detail {

template <class T, class Shape>
VI_HD inline event<T, Shape> plain_event(status what, int contact, int side, const T& duration,
                                         const vec<T, Shape::max_dimension>& before) {
    return {what, contact, side, 0, 0, 0, duration, T(0.0), T(0.0), before};
}

// An event without its derivatives.
template <class T, class Shape>
VI_HD inline event<double, Shape> values(const event<T, Shape>& e, int n) {
    return {e.what,
            e.contact,
            e.side,
            e.wanted,
            e.applications,
            e.examined,
            plain(e.duration),
            plain(e.rate_before),
            plain(e.rate_after),
            values_of(e.before, n)};
}

// Rate of a touching contact from y, zero where it is rounding; free coordinates.
template <class T, class Flow>
VI_HD inline void set_rate(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at,
                           int i) {
    at.rate[i] =
        -at.touching[i] * guard_value(system.modes[0].guards[i], 1, at.y, system.dimension());
    if (abs(plain(at.rate[i])) <= tie_margin * terms_of(system, at, i, 1)) at.rate[i] = T(0.0);
}

// Finds the other stops that are reached within rounding at the moment of an event, or not left yet. A gap that the
// mode `flown` keeps has no rate: what rounding has made of its velocity in y says nothing. Where one was
// touching, it is.
template <class T, class Flow>
VI_HD inline void touch_neighbours(const hybrid<Flow>& system,
                                   trajectory<T, typename Flow::shape_type>& at, int hit,
                                   const typename hybrid<Flow>::mode_type& flown) {
    const auto& free = system.modes[0];
    const int n = system.dimension();
    for (int i = 0; i < system.contacts(); ++i) {
        if (i == hit || side_in_code(at.held, i) != 0.0) continue;
        const bool kept = keeps_gap(flown, i);
        if (kept && at.touching[i] != 0.0) continue;
        at.touching[i] = 0.0;
        const auto& g = free.guards[i];
        const double u = plain(guard_value(g, 0, at.y, n));
        const double side = side_within(g, u, terms_of(system, at, i, 0));
        if (side == 0.0) continue;
        at.touching[i] = side;
        at.flat[i] = 0.0;
        at.rate[i] = T(0.0);
        if (!kept) set_rate(system, at, i);
    }
}

// Whether an impact at a contact moves others that touch and do not leave.
template <class T, class Flow>
VI_HD inline bool moves_others(const hybrid<Flow>& system,
                               const trajectory<T, typename Flow::shape_type>& at, int hit) {
    for (int i = 0; i < system.contacts(); ++i) {
        if (i == hit || at.touching[i] == 0.0) continue;
        const double rate = plain(at.rate[i]);
        if (rate < 0.0 || (rate == 0.0 && gap_mobility(system, at, hit, i) != 0.0)) return true;
    }
    return false;
}

// Contacts at rest that no force holds leave, if at no speed yet; free coordinates.
template <class T, class Flow>
VI_HD inline void open_unpressed(const hybrid<Flow>& system,
                                 trajectory<T, typename Flow::shape_type>& at) {
    if (!any_at_rest(at, system.contacts())) return;
    const auto resting = find_resting(system, on_stops(system, at));
    const auto pressed = solve_with_ties(resting.problem);
    for (int i = 0; pressed.closed >= 0 && i < resting.others.count; ++i)
        if (!((pressed.closed | pressed.tied) >> i & 1))
            at.rate[resting.others.index[i]] = T(0x1p-1000);
}

// A plastic contact that opens from rest, and whose impact has driven others together, may be driven
// together by them in turn, and drive them together again: where one round does, all do, after times
// that shrink faster than any power, and end at rest. The momenta along the gaps say where, whenever
// this is noticed. Free coordinates.
template <class T, class Flow>
VI_HD inline bool end_alternation(const hybrid<Flow>& system,
                                  trajectory<T, typename Flow::shape_type>& at, int hit) {
    if (restitution_at(system, hit, plain(at.touching[hit])) != 0.0) return false;
    if (plain(at.rate[hit]) != 0.0 || approached(at, system.contacts()) < 0) return false;
    auto round = at;
    open_unpressed(system, round);
    if (!(plain(round.rate[hit]) > 0.0) || !resolve_impact(system, round))
        return false; // the others
    if (!(plain(round.rate[hit]) < 0.0)) return false;
    open_unpressed(system, round);
    if (!resolve_impact(system, round) || approached(round, system.contacts()) < 0) return false;
    return resolve_impact(system, at, 0.0);
}

// The impact of everything that touches with a negative rate; free coordinates.
template <class T, class Flow>
VI_CALL event<T, typename Flow::shape_type> impact_at(const hybrid<Flow>& system,
                                                      trajectory<T, typename Flow::shape_type>& at,
                                                      int contact, const T& duration) {
    open_unpressed(system, at);
    auto e = plain_event<T, typename Flow::shape_type>(
        moves_others(system, at, contact) ? status::simultaneous : status::impact, contact,
        static_cast<int>(plain(at.touching[contact])), duration, at.y);
    e.rate_before = at.rate[contact];
    if (!resolve_impact(system, at)) e.what = status::undecided;
    if (end_alternation(system, at, contact)) e.what = status::simultaneous;
    set_on_stops(system, at);
    e.rate_after = at.rate[contact];
    return e;
}

// Status of a flight that ends on no stop.
VI_HD inline status status_of(flight_end end) {
    switch (end) {
    case flight_end::horizon:
        return status::horizon;
    case flight_end::paused:
        return status::paused;
    case flight_end::searching:
        return status::searching;
    case flight_end::steps:
        return status::steps;
    case flight_end::diverged:
        return status::diverged;
    default:
        return status::undecided;
    }
}

// The limits that a flight without a transition has not left, as nothing moves it off them; of others nothing is known.
template <class T, class Flow>
VI_HD inline void keep_limits(const hybrid<Flow>& system,
                              trajectory<T, typename Flow::shape_type>& at, double applications) {
    const auto before = at.elements;
    at.elements = {before.code, true, 0, before.size};
    const auto& m = system.modes[at.mode];
    for (int j = 0; j < m.watched.count; ++j) {
        if (!before.stays_on(j)) continue;
        const auto& g = m.watched.at[j].row;
        const int side = before.zeros[j] > 0 ? 1 : -1;
        const double limit = side > 0 ? g.upper : g.lower;
        const double margin = side * (limit - plain(guard_value(g, 0, at.y, system.dimension())));
        const double terms = plain(magnitude(g, 0, at.y, m.flow)) + abs(limit);
        if (abs(margin - before.offset[j]) > rounding_after(applications, terms)) continue;
        at.elements.zeros[j] = before.zeros[j];
        at.elements.offset[j] = before.offset[j];
    }
}

// A flight that ends on no stop: paused, at the horizon, or given up.
template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
end_without_transition(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at,
                       const landing<T, typename Flow::shape_type>& end) {
    for (int i = 0; i < system.contacts() && plain(end.duration) > 0.0; ++i) {
        const bool held = side_in_code(at.held, i) != 0.0;
        if (!held && !keeps_gap(system.modes[at.mode], i)) at.touching[i] = 0.0;
        if (!(held && plain(at.flat[i]) < 0.0)) at.flat[i] = 0.0; // closed without force it stays
    }
    if constexpr (Flow::shape_type::max_watches > 0)
        if (plain(end.duration) > 0.0) keep_limits(system, at, end.applications);
    return plain_event<T, typename Flow::shape_type>(status_of(end.end), end.contact, end.side,
                                                     end.duration, in_free_coordinates(system, at));
}

// The force of a closed contact has fallen to zero; free coordinates.
template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
release(const hybrid<Flow>&, trajectory<T, typename Flow::shape_type>& at,
        const landing<T, typename Flow::shape_type>& end) {
    const double side = side_in_code(at.held, end.contact);
    at.held -= code_of(end.contact, side);
    return plain_event<T, typename Flow::shape_type>(status::release, end.contact,
                                                     static_cast<int>(side), end.duration, at.y);
}

// A watch of an element has reached its limit; free coordinates. What the element does is decided after the
// event (transition/elements.hpp), which has the number of the element behind those of the contacts.
template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
reach_watch(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at,
            const landing<T, typename Flow::shape_type>& end,
            const typename hybrid<Flow>::mode_type& flown) {
    at.flat = {};
    touch_held(system, at, at.held);
    const status what = end.end == flight_end::grazing ? status::grazing : status::change;
    auto e =
        plain_event<T, typename Flow::shape_type>(what, end.contact, end.side, end.duration, at.y);
    e.rate_before = e.rate_after = end.rate;
    if constexpr (Flow::shape_type::max_watches > 0) {
        const auto& w = system.modes[at.mode].watched.at[end.contact - system.contacts()];
        e.contact = system.contacts() + w.element;
        const bool crossed = what == status::change;
        if (crossed && w.reset >= 0) {
            const auto before = at.y;
            const int n = system.dimension();
            at.y = system.resets[w.reset](before, n);
            for (int i = 0; i < system.contacts(); ++i) { // may be thrown off, or pressed
                const auto& gap = system.modes[0].guards[i];
                const bool moved =
                    plain(guard_value(gap, 1, at.y, n)) != plain(guard_value(gap, 1, before, n));
                if (at.touching[i] != 0.0 && moved) set_rate(system, at, i);
            }
        }
        if (crossed && w.target >= 0) {
            at.elements.code = w.target;
            at.mode = system.find_mode(w.target);
        }
        touch_neighbours(system, at, end.contact, flown);
    }
    return e;
}

// A gap that touches zero; free coordinates.
template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
graze(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at,
      const landing<T, typename Flow::shape_type>& end, bool from_rest) {
    at.touching[end.contact] = end.side;
    at.rate[end.contact] = T(0.0);
    if (from_rest) set_on_stops(system, at);
    return plain_event<T, typename Flow::shape_type>(status::grazing, end.contact, end.side,
                                                     end.duration, at.y);
}

// A gap that falls through zero; free coordinates. A bounce from rest whose rate is rounding grazes.
template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
arrive(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at,
       const landing<T, typename Flow::shape_type>& end, bool from_rest) {
    const int c = end.contact;
    if (from_rest && -plain(end.rate) <= tie_margin * terms_of(system, at, c, 1))
        return graze(system, at, end, from_rest);
    at.touching[c] = end.side;
    at.rate[c] = end.rate;
    return impact_at(system, at, c, end.duration);
}

template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
event_of_rest(const hybrid<Flow>& system, const trajectory<T, typename Flow::shape_type>& at,
              const rest<T>& r) {
    const status what = r.what == rest_kind::chatter ? status::chatter
                        : r.what == rest_kind::stick ? status::stick
                                                     : status::missing_mode;
    const int side = r.contact >= 0 ? static_cast<int>(plain(at.touching[r.contact])) : 0;
    auto e = plain_event<T, typename Flow::shape_type>(what, r.contact, side, r.duration,
                                                       in_free_coordinates(system, at));
    if (what == status::missing_mode) e.wanted = r.code;
    return e;
}

} // namespace detail

// Kind of the end of a flight, by the guard that it ends on and the mode it was in.
enum class transition { none, impact, grazing, release, change };
template <class T, class Flow>
VI_HD inline transition transition_of(const hybrid<Flow>& system,
                                      const trajectory<T, typename Flow::shape_type>& at,
                                      const landing<T, typename Flow::shape_type>& end) {
    if (end.end != flight_end::contact && end.end != flight_end::grazing) return transition::none;
    if (end.contact >= system.contacts()) return transition::change;
    if (system.modes[at.mode].guards[end.contact].closed) return transition::release;
    return end.end == flight_end::grazing ? transition::grazing : transition::impact;
}

// The end of a flight, and the transition that it is.
template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
cross_guard(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at,
            const landing<T, typename Flow::shape_type>& end) {
    const transition what = transition_of(system, at, end);
    at.y = end.y;
    renormalise_forcing(at.y, system.dimension(), system.lines(), system.inverse_omega_squared);
    if (what == transition::none) return detail::end_without_transition(system, at, end);
    const auto& flown = system.modes[at.mode];
    leave_mode(system, at);
    const int c = end.contact;
    if (what == transition::change) return detail::reach_watch(system, at, end, flown);
    const bool from_rest = at.touching[c] == end.side && plain(at.rate[c]) == 0.0;
    at.flat = {};
    touch_held(system, at, at.held);
    detail::touch_neighbours(system, at, c, flown);
    if (what == transition::release) return detail::release(system, at, end);
    if (what == transition::grazing) return detail::graze(system, at, end, from_rest);
    return detail::arrive(system, at, end, from_rest);
}

// The impact of a touching contact that is approached, at the same instant.
template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
impact_at_once(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at,
               int contact) {
    detail::touch_neighbours(system, at, contact, system.modes[at.mode]);
    return detail::impact_at(system, at, contact, T(0.0));
}

// Events of rest on a stop before a flight: contacts that are pressed close, chatter is completed.
// False where it does nothing; `e` is what was done.
template <class T, class Flow>
VI_HD inline bool before_flight(const hybrid<Flow>& system,
                                trajectory<T, typename Flow::shape_type>& at, double horizon,
                                event<T, typename Flow::shape_type>& e) {
    rest<T> r = begin_sticking(system, at);
    if (r.what == rest_kind::none) r = complete_chatter(system, at, horizon);
    if (r.what == rest_kind::none) return false;
    e = detail::event_of_rest(system, at, r);
    return true;
}

// The impact that ends a round, in every lane that landed. `before` is what the entries of oscillators were
// that it changes: velocities alone, unless the flow is mixed.
template <class T, class Mode, class Law, class Shape, class Rates>
VI_HOT void impact_of_round(const Mode& m, const Law* laws, const Rates& rates,
                            const quick_landing<T>& end, const vec<T, Shape::max_dimension>& landed,
                            trajectory<T, Shape>& at, vec<T, Shape::max_dimension>& before) {
    const auto& flow = m.flow;
    vec<T, Shape::max_dimension> y;
    flow.each_coordinate([&](auto j) VI_WITHIN { y[j] = landed[j]; });
    renormalise_forcing(y, flow.dimension(), flow.lines(), rates);
    flow.each_oscillator([&](auto j) VI_WITHIN {
        before[2 * j + 1] = y[2 * j + 1];
        if (flow.mixed()) before[2 * j] = y[2 * j];
    });
    flow.each_contact([&](auto i) VI_WITHIN {
        const mask_t<T> mine = flow.contacts() == 1
                                   ? end.landed
                                   : end.landed & (end.stop.contact == static_cast<double>(i));
        const auto r =
            select(end.stop.side > 0.0, laws[i].restitution_upper, laws[i].restitution_lower);
        const T speed = select(mine, end.speed, T(0.0));
        const auto [change, after] = rebound_of(speed, r);
        const T p = change * laws[i].effective_mass;
        flow.each_oscillator([&](auto j) VI_WITHIN {
            push(y[2 * j + 1], laws[i].impulse[2 * j + 1], p);
            if (flow.mixed()) push(y[2 * j], laws[i].impulse[2 * j], p);
        });
        const T leaving = -(end.stop.side * after);
        at.touching[i] =
            select(end.landed, select(mine, end.stop.side, real_t<T>(0.0)), at.touching[i]);
        at.rate[i] = select(end.landed, leaving, at.rate[i]);
        at.flat[i] = select(end.landed, real_t<T>(0.0), at.flat[i]);
    });
    flow.each_coordinate([&](auto j) VI_WITHIN { at.y[j] = select(end.landed, y[j], landed[j]); });
}

namespace detail {

// The state before an impact, from the one after it and what the entries were that it has changed.
template <class T, int D, class Shape>
VI_HOT void put_before(const vec<T, D>& after, const vec<T, D>& changed, const sizes<Shape>& size,
                       vec<T, D>& to) {
    size.each_coordinate([&](auto j) VI_WITHIN { to[j] = after[j]; });
    size.each_oscillator([&](auto j) VI_WITHIN {
        to[2 * j + 1] = changed[2 * j + 1];
        if (size.mixed()) to[2 * j] = changed[2 * j];
    });
}

template <class T, class Flow, class Shape>
VI_HOT event<T, Shape> event_of_round(const hybrid<Flow>& system, trajectory<T, Shape>& at,
                                      const quick_landing<T>& end) {
    event<T, Shape> e; // filled in place: most of what it costs is moving it
    vec<T, Shape::max_dimension> before;
    e.what = status::impact;
    e.contact = static_cast<int>(plain(end.stop.contact));
    e.side = static_cast<int>(plain(end.stop.side));
    e.duration = end.duration;
    e.rate_before = -end.stop.side * end.speed;
    const auto y = at.y;
    impact_of_round(system.modes[0], system.laws, system.inverse_omega_squared, end, y, at, before);
    e.rate_after = at.rate[e.contact];
    put_before(at.y, before, system, e.before);
    return e;
}

} // namespace detail
} // namespace vi
