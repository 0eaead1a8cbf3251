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

template <class T, class Flow, class Observer>
VI_HD inline run_result run(const hybrid<Flow>& system,
                            trajectory<T, typename Flow::shape_type>& at, clock& now,
                            const limits& limit, Observer& observer) {
    long impacts = 0;
    int at_once = 0;
    for (long n = 0; n < limit.events; ++n) {
        const double left = limit.t_max - now.time();
        const double horizon = min(left, limit.flight_limit);
        const auto e = step(system, at, horizon);
        if (e.what == status::missing_mode) return {run_end::missing, e.code};
        now.add(plain(e.duration));
        at_once = plain(e.duration) > 0.0 ? 0 : at_once + 1;
        const bool go_on = observer.see(e, at, now);
        if (e.what == status::undecided) return {run_end::undecided, 0};
        if (e.what == status::horizon)
            return {left <= limit.flight_limit ? run_end::horizon : run_end::silent, 0};
        if (at_once > most_events_at_once) return {run_end::stalled, 0};
        impacts +=
            e.what == status::impact || e.what == status::simultaneous || e.what == status::chatter;
        if (impacts >= limit.impacts) return {run_end::impacts, 0};
        if (!go_on) return {run_end::observer, 0};
        if (n % between_questions == 0 && limit.interrupted && limit.interrupted())
            return {run_end::interrupted, 0};
    }
    return {run_end::events, 0};
}

} // namespace vi
