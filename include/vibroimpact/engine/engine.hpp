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

#include "vibroimpact/transition/elements.hpp"

namespace vi {

// Legs of one flight, 2^22 steps: some seconds to a minute.
inline constexpr int most_searched = 1024;

namespace detail {

// Whether the search has not come to an event yet.
VI_HD inline bool is_unfinished(status what) {
    return what == status::paused || what == status::searching;
}

inline constexpr int most_counted =
    1 << 30; // applications of propagators: a count that does not overflow

// Next event: rest and chatter come before the flight.
template <class T, class Flow>
VI_CALL event<T, typename Flow::shape_type>
next_event(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at, double horizon,
           bool may_pause, int earlier) {
    if constexpr (Flow::shape_type::max_watches > 0)
        if (const int due = at.elements.due; due != 0) {
            const int side = due > 0 ? 1 : -1, number = system.contacts() + side * due - 1;
            const landing<T, typename Flow::shape_type> end{
                flight_end::contact, number, side, T(0.0), T(0.0), at.y};
            return cross_guard(system, at, end);
        }
    const int struck = approached(at, system.contacts());
    if (struck >= 0) return impact_at_once(system, at, struck);
    event<T, typename Flow::shape_type> e;
    if (before_flight(system, at, horizon, e)) return e;
    const auto end = certified_flight(system.modes[at.mode], at, horizon, may_pause, earlier);
    e = cross_guard(system, at, end);
    const double applied = min(end.applications, static_cast<double>(most_counted));
    if (is_unfinished(e.what))
        e.applications = static_cast<int>(applied);
    else
        e.examined = end.examined;
    return e;
}

// Where elements have changed their states, contacts at rest beside those that are closed are decided anew with these:
// friction may have held one that is pressed now.
template <class T, class Flow>
VI_HD inline void reopen_beside(const hybrid<Flow>& system,
                                trajectory<T, typename Flow::shape_type>& at) {
    if (system.is_open(at.mode)) return;
    for (int i = 0; i < system.contacts(); ++i)
        if (at.touching[i] != 0.0 && plain(at.rate[i]) == 0.0 && side_in_code(at.held, i) == 0.0) {
            leave_mode(system, at);
            return;
        }
}

// After an event: the states of elements, then whether contacts stay closed. The code of a mode that is missing, or 0.
template <class T, class Flow>
VI_HD inline int settle_after(const hybrid<Flow>& system,
                              trajectory<T, typename Flow::shape_type>& at,
                              event<T, typename Flow::shape_type>& e) {
    if constexpr (Flow::shape_type::max_elements > 0) {
        if (!moves_on(e.what)) return 0;
        at.elements.settled = false;
        const int before = at.elements.code;
        const auto earlier = plain_state(e.before, system.dimension());
        const auto states = settle_elements(system, at, &earlier);
        if (states.what == decision::missing) return states.code;
        if (states.what == decision::undecided) e.what = status::undecided;
        if (system.elements.given) return 0;
        if (before != at.elements.code) reopen_beside(system, at);
        if (e.what != status::change) return stay_closed(system, at);
        if (before == at.elements.code) e.what = status::grazing;
        if (states.what == decision::non_unique) e.what = status::non_unique;
        for (int i = 0; i < system.elements.count && e.what == status::change; ++i) {
            const int state = state_in_code(at.elements.code, i), was = state_in_code(before, i);
            if (!system.elements.soft[i] || !meets_stop(was, state)) continue;
            e.what = status::engage; // whichever watch was found first
            e.contact = system.contacts() + i;
            e.side = side_of_soft(state);
        }
    }
    return stay_closed(system, at);
}

template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
missing_mode(const hybrid<Flow>& system, const trajectory<T, typename Flow::shape_type>& at,
             int code) {
    auto e = plain_event<T, typename Flow::shape_type>(status::missing_mode, -1, 0, T(0.0),
                                                       in_free_coordinates(system, at));
    e.wanted = code;
    return e;
}

} // namespace detail

// The certified engine: any flow, any mode, every status; it pauses in open modes, if at all. An event
// whose next flight is in a mode that is missing, or takes one to be known, did not happen yet: it
// comes again once the mode is there.
template <class T, class Flow>
VI_RARE event<T, typename Flow::shape_type>
certified_step(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at,
               double horizon, bool may_pause = false, int earlier = 0) {
    if (has_diverged(system.modes[at.mode], at.y)) // before rest and chatter
        return detail::plain_event<T, typename Flow::shape_type>(status::diverged, -1, 0, T(0.0),
                                                                 in_free_coordinates(system, at));
    if (system.elements.count == 0 && at.held == 0)
        return detail::next_event(system, at, horizon, may_pause, earlier);
    const auto states = settle_elements(system, at);
    if (states.what == decision::missing) return detail::missing_mode(system, at, states.code);
    if (states.what == decision::undecided)
        return detail::plain_event<T, typename Flow::shape_type>(status::undecided, -1, 0, T(0.0),
                                                                 in_free_coordinates(system, at));
    const auto start = at;
    auto e = detail::next_event(system, at, horizon, may_pause && at.held == 0, earlier);
    const int missing = detail::settle_after(system, at, e);
    if (missing == 0) return e;
    at = start;
    e.what = status::missing_mode;
    e.wanted = missing;
    return e;
}

// The next event if it is the end of a micro-bounce, or of the chatter that it belongs to: no round could have
// brought that flight on, as none lands so soon on the stop that it leaves (search/grid/grid_bounds.hpp).
// Otherwise paused, and nothing is changed.
template <class T, class Flow>
VI_RARE event<T, typename Flow::shape_type>
micro_bounce_step(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at,
                  double horizon) {
    using Shape = typename Flow::shape_type;
    const auto& free = system.modes[0];
    const int contacts = system.contacts();
    const auto none = [&] {
        return detail::plain_event<T, Shape>(status::paused, -1, 0, T(0.0), at.y);
    };
    if (at.mode != 0 || at.held != 0 || has_diverged(free, at.y)) return none();
    if (approached(at, contacts) >= 0 || detail::any_at_rest(at, contacts)) return none();
    const double soon = detail::end_of_bounce(free, at);
    if (!(soon <= min(detail::longest_bounce * free.flow.step, horizon))) return none();
    event<T, Shape> e;
    if (before_flight(system, at, horizon, e)) return e;
    landing<T, Shape> end;
    if (!detail::micro_bounce(free, at, soon, 0, end) || at.touching[end.contact] != end.side)
        return none();
    return cross_guard(system, at, end);
}

namespace detail {

// Whether no derivative leads some watch of its mode away from a limit that the motion is on.
template <class T, class Flow>
VI_HD inline bool stays_on_any(const hybrid<Flow>& system,
                               const trajectory<T, typename Flow::shape_type>& at) {
    for (int j = 0; j < system.modes[at.mode].watched.count; ++j)
        if (at.elements.stays_on(j)) return true;
    return false;
}

// The rest of a flight that a quick flight has brought on with so many applications, certified; paused
// where that one may go on.
template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
continue_certified(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at,
                   const T& flown, int earlier, double horizon) {
    bool may_pause = false;
    if constexpr (is_modal<Flow>) {
        const auto& flow = system.modes[0].flow;
        may_pause = may_go_on(flow, plain(flown) + flow.step, horizon);
    } else if constexpr (has_quick_modes<Flow>) {
        const auto& quick = system.modes[at.mode].quick;
        may_pause = quick.able && !stays_on_any(system, at) &&
                    may_go_on(quick.flow, plain(flown) + quick.flow.step, horizon);
    }
    for (int i = 0; plain(flown) > 0.0 && at.held == 0 && i < system.contacts(); ++i)
        if (!keeps_gap(system.modes[at.mode], i)) at.touching[i] = 0.0;
    if (plain(flown) > 0.0) earlier += applications_of_round; // of a scan that came nearer
    auto e = certified_step(system, at, horizon - plain(flown), may_pause, earlier);
    if (is_unfinished(e.what))
        e.applications =
            e.applications < most_counted - earlier ? e.applications + earlier : most_counted;
    e.duration = flown + e.duration;
    return e;
}

// Position of a motion with elements, whose guards count as contacts; those that do not leave their limit at some
// rate have the rate zero. Gaps that the mode keeps meet nothing.
template <class T, class Mode, class Shape, class Guarded>
VI_HD inline void stand(const Mode& m, const trajectory<T, Shape>& at, trajectory<T, Guarded>& to) {
    const auto& quick = m.quick;
    const int contacts = m.flow.contacts();
    for (int j = 0; j < quick.flow.dimension(); ++j)
        to.y[j] = at.y[j];
    for (int i = 0; i < quick.flow.contacts(); ++i) {
        const int number = quick.number[i];
        if (number < contacts) {
            to.touching[i] = keeps_gap(m, number) ? 0.0 : at.touching[number];
            to.rate[i] = at.rate[number];
        } else {
            const int zeros = at.elements.zeros[number - contacts];
            to.touching[i] = zeros > 0 ? 1.0 : zeros < 0 ? -1.0 : 0.0;
            to.rate[i] = T(zeros * zeros == 1 ? 1.0 : 0.0);
        }
    }
}

// The quick leg of a flight in a mode of elements. An event, or `paused` where the flight is to go on certified.
template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
fly_in_mode(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at, T& flown,
            int& earlier, double horizon) {
    using Shape = typename Flow::shape_type;
    const auto& m = system.modes[at.mode];
    event<T, Shape> e;
    e.what = status::paused;
    if (!m.quick.able || at.held != 0 || !at.elements.settled || at.elements.due != 0) return e;
    trajectory<T, guarded_of<Shape>> there;
    stand(m, at, there);
    flight_memory<typename decltype(m.quick)::flow_type> memory;
    const auto leg = quick_flight(m.quick, there, flown, horizon, memory);
    if (leg.end.landed) {
        const int side = static_cast<int>(leg.end.stop.side);
        const int number = m.quick.number[static_cast<int>(leg.end.stop.contact)];
        const landing<T, Shape> end{flight_end::contact,     number, side, leg.end.duration,
                                    -(side * leg.end.speed), there.y};
        return cross_guard(system, at, end);
    }
    earlier += leg.applications;
    if (!(plain(leg.end.duration) > plain(flown))) return e;
    flown = leg.end.duration;
    at.y = there.y;
    at.elements = {at.elements.code, true, 0, at.elements.size};
    return e;
}

// One flight to its event, in legs.
template <class T, class Flow>
VI_RARE event<T, typename Flow::shape_type>
fly_to_event(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at,
             double horizon, flight_memory<Flow>& memory, bool (*interrupted)()) {
    T flown = T(0.0);
    int earlier = 0;
    for (int searched = 0;;) {
        if constexpr (is_modal<Flow>)
            if (at.mode == 0 && at.held == 0) {
                const auto leg = quick_flight(system.modes[0], at, flown, horizon, memory);
                if (leg.end.landed) return event_of_round(system, at, leg.end);
                flown = leg.end.duration;
                earlier += leg.applications;
            }
        if constexpr (has_quick_modes<Flow>)
            if (system.elements.count > 0) {
                auto e = fly_in_mode(system, at, flown, earlier, horizon);
                if (e.what != status::paused) {
                    e.wanted = settle_after(system, at, e);
                    if (e.wanted != 0) e.what = status::missing_mode;
                    return e;
                }
            }
        memory.forget();
        auto e = continue_certified(system, at, flown, earlier, horizon);
        if (e.what == status::horizon) e.examined += searched * steps_in_a_row;
        if (!is_unfinished(e.what)) return e;
        if (e.what == status::searching) {
            if (interrupted && interrupted()) return e;
            searched += searched < most_counted / steps_in_a_row / 2;
            if (!is_modal<Flow> && searched == most_searched) {
                e.what = status::steps;
                return e;
            }
        }
        flown = e.duration;
        earlier = e.applications;
    }
}

} // namespace detail

// The next event of a run that has a memory. During a long flight the caller is asked now and then
// whether to stop: then there is no event, and the status is `searching`. Flows without blocks give up
// after `most_searched` legs of so many steps. Where a mode is missing nothing has happened.
template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
step(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at, double horizon,
     flight_memory<Flow>& memory, bool (*interrupted)() = nullptr) {
    if (system.elements.count == 0 && at.held == 0)
        return detail::fly_to_event(system, at, horizon, memory, interrupted);
    const auto start = at;
    const auto e = detail::fly_to_event(system, at, horizon, memory, interrupted);
    if (e.what == status::missing_mode) at = start;
    return e;
}
// A step without a memory of earlier flights.
template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
step(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at, double horizon) {
    flight_memory<Flow> memory;
    return step(system, at, horizon, memory);
}

} // namespace vi
