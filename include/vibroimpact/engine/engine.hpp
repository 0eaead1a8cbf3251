// The engine: flight -> event -> jump, one event per call.
//
// A scalar engine first tries the quick flight (search/grid/quick_flight.hpp), then the certified one; a pack
// engine tries the quick flight for all its lanes and hands the rest to the scalar engine, lane by
// lane. That one brings the flight off the stops that it is next to, and from there the quick one
// is tried again. Both therefore do the same operations for each trajectory, and give the same bits.
//
// What one call returns is one event: an impact, a graze, completed chatter, the beginning or the
// end of rest on a stop, the horizon, or the statement that nothing could be decided.
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
    simultaneous = 5,  // an impact that moves several touching contacts (Moreau's law)
    horizon = 6,       // no event up to the given time; from here on no event at all
    undecided = 7,     // the search could not be finished: an error, never silence
    diverged = 8,      // the state is so large that nothing can be decided
    steps = 9,         // the search took more steps than are allowed
    missing_mode = 10, // a set of closed contacts whose mode the host has to build
    paused = 11,       // none yet, within step(): the quick flight may go on
    searching = 12,    // none yet after many steps: time to ask whether to go on
};

template <class T, class Shape>
struct event {
    status what;
    int contact, side;
    int code; // closed set wanted, for missing_mode; of a flight, applications so far where there is no
              // event yet, else the steps that were looked at
    T duration; // since the previous event
    T rate_before, rate_after;
    vec<T, Shape::max_dimension> before; // free coordinates just before the jump
};

// Legs of one flight, 2^22 steps: some seconds to a minute.
inline constexpr int most_searched = 1024;

namespace detail {

// Whether there is no event yet.
VI_HD inline bool goes_on(status what) {
    return what == status::paused || what == status::searching;
}

template <class T, class Shape>
VI_HD inline event<T, Shape> plain_event(status what, int contact, int side, const T& duration,
                                         const vec<T, Shape::max_dimension>& before) {
    return {what, contact, side, 0, duration, T(0.0), T(0.0), before};
}

// An event without its derivatives.
template <class T, class Shape>
VI_HD inline event<double, Shape> values(const event<T, Shape>& e, int n) {
    return {e.what,
            e.contact,
            e.side,
            e.code,
            plain(e.duration),
            plain(e.rate_before),
            plain(e.rate_after),
            values_of(e.before, n)};
}

// Which other stops are reached within rounding at the moment of an event, or not left yet.
template <class T, class Flow>
VI_HD inline void touch_neighbours(const hybrid<Flow>& system,
                                   trajectory<T, typename Flow::shape_type>& at, int hit) {
    const auto& free = system.modes[0];
    const int n = system.dimension();
    for (int i = 0; i < system.contacts(); ++i) {
        if (i == hit || side_in_code(at.held, i) != 0.0) continue;
        at.touching[i] = 0.0;
        const auto& g = free.guards[i];
        const double u = plain(watch(g, 0, at.y, n));
        const double side = side_within(g, u, terms_of(system, at.y, i, 0));
        if (side == 0.0) continue;
        at.touching[i] = side;
        at.rate[i] = -side * watch(g, 1, at.y, n);
        at.flat[i] = 0.0;
        if (abs(plain(at.rate[i])) <= tie_margin * terms_of(system, at.y, i, 1))
            at.rate[i] = T(0.0);
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
VI_HD inline void let_leave(const hybrid<Flow>& system,
                            trajectory<T, typename Flow::shape_type>& at) {
    if (!any_at_rest(at, system.contacts())) return;
    const auto resting = find_resting(system, values(at, system.dimension(), system.contacts()));
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
    let_leave(system, round);
    if (!(plain(round.rate[hit]) > 0.0) || !resolve_impact(system, round))
        return false; // the others
    if (!(plain(round.rate[hit]) < 0.0)) return false;
    let_leave(system, round);
    if (!resolve_impact(system, round) || approached(round, system.contacts()) < 0) return false;
    return resolve_impact(system, at, 0.0);
}

// The impact of everything that touches with a negative rate; free coordinates.
template <class T, class Flow>
VI_CALL event<T, typename Flow::shape_type> strike(const hybrid<Flow>& system,
                                                   trajectory<T, typename Flow::shape_type>& at,
                                                   int contact, const T& duration) {
    let_leave(system, at);
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

// Of a flight that ends on no stop.
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

template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
finish_flight(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at,
              const landing<T, typename Flow::shape_type>& end) {
    using Shape = typename Flow::shape_type;
    const bool was_closed = end.contact >= 0 && system.modes[at.mode].guards[end.contact].closed;
    at.y = end.y;
    renormalise_forcing(at.y, system.dimension(), system.lines(), system.inverse_omega_squared);
    if (end.end != flight_end::contact && end.end != flight_end::grazing) {
        for (int i = 0; i < system.contacts() && plain(end.duration) > 0.0; ++i) {
            const bool held = side_in_code(at.held, i) != 0.0;
            if (!held) at.touching[i] = 0.0;
            if (!(held && plain(at.flat[i]) < 0.0))
                at.flat[i] = 0.0; // closed without force it stays
        }
        return plain_event<T, Shape>(status_of(end.end), end.contact, end.side, end.duration,
                                     in_free_coordinates(system, at));
    }
    leave_mode(system, at);
    const int c = end.contact;
    const bool from_rest = at.touching[c] == end.side && plain(at.rate[c]) == 0.0;
    at.flat = {};
    touch_held(system, at, at.held);
    touch_neighbours(system, at, c);
    if (was_closed) {
        const double side = side_in_code(at.held, c);
        at.held -= code_of(c, side);
        return plain_event<T, Shape>(status::release, c, static_cast<int>(side), end.duration,
                                     at.y);
    }
    at.touching[c] = end.side;
    const bool lost = // a hop from rest, within rounding
        from_rest && -plain(end.rate) <= tie_margin * terms_of(system, at.y, c, 1);
    if (end.end == flight_end::grazing || lost) {
        at.rate[c] = T(0.0);
        if (from_rest) set_on_stops(system, at);
        return plain_event<T, Shape>(status::grazing, c, end.side, end.duration, at.y);
    }
    at.rate[c] = end.rate;
    return strike(system, at, c, end.duration);
}

template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
event_of_rest(const hybrid<Flow>& system, const trajectory<T, typename Flow::shape_type>& at,
              const rest<T>& r) {
    const status what = r.what == settled::chatter ? status::chatter
                        : r.what == settled::stick ? status::stick
                                                   : status::missing_mode;
    const int side = r.contact >= 0 ? static_cast<int>(plain(at.touching[r.contact])) : 0;
    auto e = plain_event<T, typename Flow::shape_type>(what, r.contact, side, r.duration,
                                                       in_free_coordinates(system, at));
    e.code = what == status::missing_mode ? r.code : 0;
    return e;
}

inline constexpr int most_counted = 1 << 30; // applications

// What happens next, rest and chatter before flight.
template <class T, class Flow>
VI_CALL event<T, typename Flow::shape_type>
next_event(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at, double horizon,
           bool may_pause, int earlier) {
    const int struck = approached(at, system.contacts());
    if (struck >= 0) {
        touch_neighbours(system, at, struck);
        return strike(system, at, struck, T(0.0));
    }
    const rest<T> r = settle(system, at, horizon);
    if (r.what != settled::nothing) return event_of_rest(system, at, r);
    const auto end = certified_flight(system.modes[at.mode], at, horizon, may_pause, earlier);
    auto e = finish_flight(system, at, end);
    const double applied = min(end.applications, static_cast<double>(most_counted));
    e.code = goes_on(e.what) ? static_cast<int>(applied) : end.looked;
    return e;
}

} // namespace detail

// The certified engine: any flow, any mode, every status; it pauses in free flight, if at all. An event
// whose next flight is in a mode that is missing, or takes one to be known, did not happen yet: it
// comes again once the mode is there.
template <class T, class Flow>
VI_CALL event<T, typename Flow::shape_type>
certified_step(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at,
               double horizon, bool may_pause = false, int earlier = 0) {
    if (has_diverged(system.modes[at.mode], at.y)) // before rest and chatter are looked at
        return detail::plain_event<T, typename Flow::shape_type>(status::diverged, -1, 0, T(0.0),
                                                                 in_free_coordinates(system, at));
    if (at.held == 0) return detail::next_event(system, at, horizon, may_pause, earlier);
    const auto start = at;
    auto e = detail::next_event(system, at, horizon, false, earlier);
    const int missing = stay_closed(system, at);
    if (missing == 0) return e;
    at = start;
    e.what = status::missing_mode;
    e.code = missing;
    return e;
}

// The next event if it is the end of a hop, or of the chatter that it belongs to: no round could have
// brought that flight on, as none lands so soon on the stop that it leaves (search/grid/grid_bounds.hpp).
// Otherwise paused, and nothing is changed.
template <class T, class Flow>
VI_CALL event<T, typename Flow::shape_type>
hop_step(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at, double horizon) {
    using Shape = typename Flow::shape_type;
    const auto& free = system.modes[0];
    const int contacts = system.contacts();
    const auto none = [&] {
        return detail::plain_event<T, Shape>(status::paused, -1, 0, T(0.0), at.y);
    };
    if (at.mode != 0 || at.held != 0 || has_diverged(free, at.y)) return none();
    if (approached(at, contacts) >= 0 || detail::any_at_rest(at, contacts)) return none();
    const double soon = detail::end_of_hop(free, at);
    if (!(soon <= min(detail::longest_hop * free.flow.step, horizon))) return none();
    const rest<T> r = settle(system, at, horizon);
    if (r.what != settled::nothing) return detail::event_of_rest(system, at, r);
    landing<T, Shape> end;
    if (!detail::hop(free, at, soon, 0, end) || at.touching[end.contact] != end.side) return none();
    return detail::finish_flight(system, at, end);
}

// Apply the impact that ends a quick flight, in every lane where it was proved. `before` is what the
// entries of oscillators were that it changes: velocities alone, unless the flow is mixed.
template <class T, class Mode, class Law, class Shape, class Rates>
VI_HOT void quick_impact(const Mode& m, const Law* laws, const Rates& rates,
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
        const T back = ((1.0 + r) * speed) * laws[i].effective_mass;
        flow.each_oscillator([&](auto j) VI_WITHIN {
            y[2 * j + 1] = fnma(laws[i].impulse[2 * j + 1], back, y[2 * j + 1]);
            if (flow.mixed()) y[2 * j] = fnma(laws[i].impulse[2 * j], back, y[2 * j]);
        });
        const T leaving = end.stop.side * (r * speed);
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
VI_HOT event<T, Shape> quick_event(const hybrid<Flow>& system, trajectory<T, Shape>& at,
                                   const quick_landing<T>& end) {
    event<T, Shape> e; // filled in place: most of what it costs is moving it
    vec<T, Shape::max_dimension> before;
    e.what = status::impact;
    e.contact = static_cast<int>(plain(end.stop.contact));
    e.side = static_cast<int>(plain(end.stop.side));
    e.code = 0;
    e.duration = end.duration;
    e.rate_before = -end.stop.side * end.speed;
    const auto y = at.y;
    quick_impact(system.modes[0], system.laws, system.inverse_omega_squared, end, y, at, before);
    e.rate_after = at.rate[e.contact];
    put_before(at.y, before, system, e.before);
    return e;
}

// The rest of a flight that a quick flight has brought on with so many applications, certified; paused
// where that one may go on.
template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
go_on(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at, const T& flown,
      int earlier, double horizon) {
    const auto& flow = system.modes[0].flow;
    bool may_pause = false;
    if constexpr (is_modal<Flow>) may_pause = may_go_on(flow, plain(flown) + flow.step, horizon);
    for (int i = 0; plain(flown) > 0.0 && at.held == 0 && i < system.contacts(); ++i)
        at.touching[i] = 0.0;
    if (plain(flown) > 0.0) earlier += applications_of_round; // of a look that came nearer
    auto e = certified_step(system, at, horizon - plain(flown), may_pause, earlier);
    if (goes_on(e.what)) e.code = e.code < most_counted - earlier ? e.code + earlier : most_counted;
    e.duration = flown + e.duration;
    return e;
}

// One flight to its event, in legs.
template <class T, class Flow>
VI_CALL event<T, typename Flow::shape_type>
fly(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at, double horizon,
    flight_memory<Flow>& memory, bool (*interrupted)()) {
    T flown = T(0.0);
    int earlier = 0;
    for (int searched = 0;;) {
        if constexpr (is_modal<Flow>)
            if (at.mode == 0 && at.held == 0) {
                const auto leg = quick_flight(system.modes[0], at, flown, horizon, memory);
                if (leg.end.landed) return quick_event(system, at, leg.end);
                flown = leg.end.duration;
                earlier += leg.applications;
            }
        memory.forget();
        auto e = go_on(system, at, flown, earlier, horizon);
        if (!goes_on(e.what)) return e;
        if (e.what == status::searching) {
            if (interrupted && interrupted()) return e;
            if (!is_modal<Flow> && ++searched == most_searched) {
                e.what = status::steps;
                return e;
            }
        }
        flown = e.duration;
        earlier = e.code;
    }
}

} // namespace detail

// The next event of a run that has a memory. A flight that goes on for long asks whether it may: where
// the answer is to stop, there is no event, and its status is `searching`. Flows without blocks give up
// after `most_searched` legs of so many steps. Where a mode is missing nothing has happened.
template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
step(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at, double horizon,
     flight_memory<Flow>& memory, bool (*interrupted)() = nullptr) {
    if (at.held == 0) return detail::fly(system, at, horizon, memory, interrupted);
    const auto start = at;
    const auto e = detail::fly(system, at, horizon, memory, interrupted);
    if (e.what == status::missing_mode) at = start;
    return e;
}
// The same of one that has none.
template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
step(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at, double horizon) {
    flight_memory<Flow> memory;
    return step(system, at, horizon, memory);
}

} // namespace vi
