// Runs: events one after the other, a clock that does not drift, and the reasons to stop.
//
// An observer is any object with  bool see(const event&, const trajectory&, const clock&)  that
// answers whether to go on; it is called after every event.
#pragma once

#include "vibroimpact/engine.hpp"

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
    double t_max;                    // of the whole run
    double flight_limit;             // longest flight without an event
    long events;                     // records
    long impacts;                    // of status impact, simultaneous or chatter
    bool (*interrupted)() = nullptr; // asked now and then; true ends the run
};
inline constexpr long between_questions = 4096; // events

// At one instant only so many events are plausible; more means that nothing moves on.
inline constexpr int most_events_at_once = 64;

enum class run_end : int {
    none = -1,       // not ended
    impacts = 0,     // the number of impacts asked for was reached
    horizon = 1,     // t_max was reached
    silent = 2,      // no event within flight_limit
    undecided = 3,   // an event could not be decided
    stalled = 4,     // time does not advance
    missing = 5,     // the host has to build a mode
    events = 6,      // the record is full
    observer = 7,    // the observer had enough
    interrupted = 8, // from outside
};

struct run_result {
    run_end why;
    int code; // closed set wanted, for missing
};

// How far a run has come.
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
    return what == status::impact || what == status::simultaneous || what == status::chatter;
}

template <class T, class Shape>
VI_HD inline void count(run_progress& p, const event<T, Shape>& e) {
    p.now.add(plain(e.duration));
    p.at_once = plain(e.duration) > 0.0 ? 0 : p.at_once + 1;
    p.impacts += counts_as_impact(e.what);
    ++p.events;
}

// Does a run end with an event that was counted? `left` was the time left before it.
template <class T, class Shape>
VI_HD inline run_end end_of_run(const run_progress& p, const event<T, Shape>& e,
                                const limits& limit, double left) {
    if (e.what == status::undecided) return run_end::undecided;
    if (e.what == status::horizon)
        return left <= limit.flight_limit ? run_end::horizon : run_end::silent;
    if (p.at_once > most_events_at_once) return run_end::stalled;
    return p.impacts >= limit.impacts ? run_end::impacts : run_end::none;
}

// Go on until a limit is reached. The counts of events and impacts are those of the whole run.
template <class T, class Flow, class Observer>
VI_HD inline run_result run(const hybrid<Flow>& system,
                            trajectory<T, typename Flow::shape_type>& at, run_progress& so_far,
                            const limits& limit, Observer& observer) {
    flight_memory<Flow> memory;
    while (so_far.events < limit.events) {
        const double left = limit.t_max - so_far.now.time();
        const auto e = step(system, at, min(left, limit.flight_limit), memory);
        if (e.what == status::missing_mode) return {run_end::missing, e.code};
        count(so_far, e);
        const bool go_on = observer.see(e, at, so_far.now);
        const run_end why = end_of_run(so_far, e, limit, left);
        if (why != run_end::none) return {why, 0};
        if (!go_on) return {run_end::observer, 0};
        if (so_far.events % between_questions == 0 && limit.interrupted && limit.interrupted())
            return {run_end::interrupted, 0};
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
