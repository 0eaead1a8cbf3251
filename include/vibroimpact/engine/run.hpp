// Runs: events one after the other, a clock that does not drift, and the reasons to stop.
//
// An observer is any object with  bool see(const event&, const trajectory&, const clock&)  that
// returns whether to continue; it is called after every event.
#pragma once

#include "vibroimpact/engine/engine.hpp"

namespace vi {

// A sum of durations as an unevaluated pair high + low: exact to 2^-100 of the total.
struct clock {
    double high = 0.0, low = 0.0;

    VI_HD void add(double t) { // two-sum (Knuth)
        const double sum = high + t;
        const double part = sum - high;
        low = low + ((high - (sum - part)) + (t - part));
        high = sum;
    }
    VI_HD double time() const { return high + low; }
};

struct limits {
    double t_max; // of the whole run
    double
        flight_limit; // with t_max infinite: flights this long are asked whether an event is to come
    long events;      // records
    long impacts;     // of status impact, simultaneous or chatter
    bool (*interrupted)() = nullptr; // called now and then; true ends the run
};
inline constexpr long between_interrupt_checks = 4096; // events, and steps of certified flights

// At one instant only so many events are plausible, as impacts that drive each other's contacts together
// die out geometrically; more means that nothing moves on.
inline constexpr int most_events_at_once = 4096;

enum class run_end : int {
    none = -1,       // not ended
    impacts = 0,     // the requested number of impacts was reached
    horizon = 1,     // t_max was reached
    silent = 2,      // no event is to come, which is proved; t_max is infinite
    undecided = 3,   // an event could not be decided
    stalled = 4,     // time does not advance
    missing = 5,     // the host has to build a mode
    events = 6,      // the record is full
    observer = 7,    // the observer had enough
    interrupted = 8, // from outside
    diverged = 9,    // the state is so large that nothing can be decided
    steps = 10,      // a flight took more steps than are allowed
    quiet = 12, // no event in a long flight, nor proof that one comes or none; t_max is infinite
};

struct run_result {
    run_end why;
    int code; // closed set wanted, for missing
};

// Progress of a run.
struct run_progress {
    clock now{};
    long events = 0, impacts = 0;
    int at_once = 0; // events at the present instant
};

// A run under way: what is needed to go on.
template <class T, class Flow>
struct motion {
    trajectory<T, typename Flow::shape_type> at;
    run_progress so_far{};
};

VI_HD inline bool counts_as_impact(status what) {
    return what == status::impact || what == status::simultaneous || what == status::chatter ||
           what == status::engage;
}

template <class T, class Shape>
VI_HD inline void count(run_progress& p, const event<T, Shape>& e) {
    p.now.add(plain(e.duration));
    p.at_once = plain(e.duration) > 0.0 ? 0 : p.at_once + 1;
    p.impacts += counts_as_impact(e.what);
    ++p.events;
}

// The reason to end a run after an event that was counted; `quietly`: where there was none.
template <class T, class Shape>
VI_HD inline run_end end_of_run(const run_progress& p, const event<T, Shape>& e,
                                const limits& limit, run_end quietly) {
    if (e.what == status::undecided) return run_end::undecided;
    if (e.what == status::diverged) return run_end::diverged;
    if (e.what == status::steps) return run_end::steps;
    if (e.what == status::horizon) return quietly;
    if (p.at_once > most_events_at_once) return run_end::stalled;
    return p.impacts >= limit.impacts ? run_end::impacts : run_end::none;
}

namespace detail {

// Steps that may be examined in a flight of which nothing is proved: a tenth of a second or so.
inline constexpr long most_examined = 1 << 17;

// After what time there is surely an event, as some contact drifts towards a stop; infinite where that
// is not known, or is so long that the phase would be lost, to 1/50 in 2^47 steps, or the time.
template <class T, class Flow>
VI_HD inline double surely_over(const hybrid<Flow>& system,
                                const trajectory<T, typename Flow::shape_type>& at) {
    double soonest = infinity();
    if constexpr (is_modal<Flow>) {
        const auto& m = system.modes[at.mode];
        const auto y = plain_state(at.y, m.flow.dimension());
        for (int i = 0; i < m.flow.contacts(); ++i)
            soonest = min(soonest, surely_met(m.guards[i], m.flow, y));
        if (soonest > (system.lines() > 0 ? 0x1p47 : most_steps) * m.flow.step) return infinity();
    }
    return soonest;
}

// The next event within `left`. Without an end to the run it is searched for as long as one may come at a
// small cost, twice as long from time to time; `quietly` says why there is none.
template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
next_within(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at, double left,
            const limits& limit, flight_memory<Flow>& memory, run_end& quietly) {
    quietly = run_end::horizon;
    const double first = left < infinity() ? left : limit.flight_limit;
    auto e = step(system, at, first, memory, limit.interrupted);
    if (left < infinity()) return e;
    const double longest = 0.5 * most_steps * system.modes[at.mode].flow.step;
    for (long examined = e.examined; e.what == status::horizon; examined += e.examined) {
        quietly = run_end::silent;
        if (is_silent(system.modes[at.mode], at.y, at)) return e;
        quietly = run_end::quiet;
        const T flown = e.duration;
        const double sure = surely_over(system, at);
        const bool goes_on = examined < most_examined && plain(flown) < longest;
        if (!(sure < infinity()) && !goes_on) return e;
        e = step(system, at, sure < infinity() ? sure : plain(flown), memory, limit.interrupted);
        e.duration = flown + e.duration;
        if (sure < infinity()) return e;
    }
    return e;
}

// The next event of a run; where a mode is missing the position is left as it was.
template <class T, class Flow>
VI_HD inline event<T, typename Flow::shape_type>
next_of_run(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at, double left,
            const limits& limit, flight_memory<Flow>& memory, run_end& quietly) {
    if (at.held == 0) return next_within(system, at, left, limit, memory, quietly);
    const auto start = at;
    const auto e = next_within(system, at, left, limit, memory, quietly);
    if (e.what == status::missing_mode) at = start;
    return e;
}

} // namespace detail

// Continue until a limit is reached. The counts of events and impacts are those of the whole run.
template <class T, class Flow, class Observer>
VI_HD inline run_result run(const hybrid<Flow>& system,
                            trajectory<T, typename Flow::shape_type>& at, run_progress& so_far,
                            const limits& limit, Observer& observer) {
    flight_memory<Flow> memory;
    long work = 0; // since the last check for an interrupt
    if (so_far.events == 0 && has_diverged(system.modes[at.mode], at.y)) {
        const auto e = certified_step(system, at, 0.0);
        count(so_far, e);
        observer.see(e, at, so_far.now);
        return {run_end::diverged, 0};
    }
    while (so_far.events < limit.events) {
        const double left = limit.t_max - so_far.now.time();
        run_end quietly = run_end::horizon;
        const auto e = detail::next_of_run(system, at, left, limit, memory, quietly);
        if (e.what == status::missing_mode) return {run_end::missing, e.wanted};
        if (e.what == status::searching) {
            so_far.now.add(plain(e.duration));
            return {run_end::interrupted, 0};
        }
        count(so_far, e);
        const bool go_on = observer.see(e, at, so_far.now);
        const run_end why = end_of_run(so_far, e, limit, quietly);
        if (why != run_end::none) return {why, 0};
        if (!go_on) return {run_end::observer, 0};
        work += 1 + e.examined;
        if constexpr (!is_modal<Flow>) // observers march where the flight strode
            work += static_cast<long>(min(plain(e.duration) / system.modes[0].flow.step,
                                          static_cast<double>(between_interrupt_checks)));
        if (work < between_interrupt_checks) continue;
        work = 0;
        if (limit.interrupted && limit.interrupted()) return {run_end::interrupted, 0};
    }
    return {run_end::events, 0};
}

// A run that begins at the time of a clock, and moves it.
template <class T, class Flow, class Observer>
VI_HD inline run_result run(const hybrid<Flow>& system,
                            trajectory<T, typename Flow::shape_type>& at, clock& now,
                            const limits& limit, Observer& observer) {
    run_progress so_far{now};
    const auto end = run(system, at, so_far, limit, observer);
    now = so_far.now;
    return end;
}

} // namespace vi
