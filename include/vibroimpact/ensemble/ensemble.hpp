// One member of an ensemble: a trajectory over a window of time, shown to observers.
//
// Method      From t = 0 the motion runs settle + observe units of time; the flight in progress at
//             the end is cut there. Observers (observe/) see what lies after `settle`; the flight
//             that is under way at that time counts from there on.
//             Where tangents are wanted, the motion goes on in jets from a quarter of the observed
//             time before the window. Values of jets have the bits of doubles; only what is known of
//             flights that repeat (search/grid/recall_period.hpp) is forgotten there.
// Accuracy    that of the engine: the same bits for the same system and start, whatever else runs
// Fails       member_end: every outcome is data. Results are of the whole window or none
#pragma once

#include "vibroimpact/observe/follow_tangents.hpp"
#include "vibroimpact/observe/observers.hpp"

namespace vi {

enum class member_end : int {
    ok = 0,                  // the end of the window was reached
    max_impacts = 1,         // the largest number of impacts was reached before
    undecided = 2,           // an event could not be decided
    stalled = 3,             // time does not advance
    missing = 4,             // a closed set of contacts has no mode
    initial_penetration = 5, // the start lies behind a stop
    interrupted = 6,         // from outside
    diverged = 8,            // the state is so large that nothing can be decided
    steps = 9,               // a flight took more steps than are allowed
};

struct window {
    double settle, observe;
    long most_impacts;
    bool (*interrupted)() = nullptr;
};

// Room for releases and grazes beside the impacts, and for a motion without any.
inline constexpr long events_per_impact = 4, spare_events = 64;
// Tangents turn to their own directions during this part of the observed time before the window.
inline constexpr double aligning = 0.25;

VI_HD inline limits limits_of(const window& w) {
    return {w.settle + w.observe, infinity(), events_per_impact * w.most_impacts + spare_events,
            w.most_impacts, w.interrupted};
}

VI_HD inline member_end end_of_member(run_end why) {
    switch (why) {
    case run_end::horizon:
        return member_end::ok;
    case run_end::undecided:
        return member_end::undecided;
    case run_end::stalled:
        return member_end::stalled;
    case run_end::missing:
        return member_end::missing;
    case run_end::interrupted:
        return member_end::interrupted;
    case run_end::diverged:
        return member_end::diverged;
    case run_end::steps:
        return member_end::steps;
    default:
        return member_end::max_impacts;
    }
}

// Onlooker of a run, which sees its events: observers, after tangents where there are any.
template <class Flow>
struct onlooker {
    using Shape = typename Flow::shape_type;
    const hybrid<Flow>& system;
    observers<Flow>& all;
    double until; // the run is left after the first event from this time on

    VI_HD bool see(const event<double, Shape>& e, const trajectory<double, Shape>& at,
                   const clock& now) {
        all.on_event(system, e, at, now);
        return now.time() < until;
    }
};
template <class Flow, int W>
struct tangent_onlooker {
    using Shape = typename Flow::shape_type;
    onlooker<Flow> values;
    tangent_follower<Flow, W> tangents;

    VI_HD bool see(const event<jet<double, W>, Shape>& e, trajectory<jet<double, W>, Shape>& at,
                   const clock& now) {
        const int n = values.system.dimension(), contacts = values.system.contacts();
        tangents.see(e, at, now);
        return values.see(detail::values(e, n), detail::values(at, n, contacts), now);
    }
};

namespace detail {

// Run, and ask the host for modes that are missing: build(code) says whether there is one now.
template <class T, class Flow, class Onlooker, class Build>
VI_HD inline run_end run_building(const hybrid<Flow>& system, motion<T, Flow>& m,
                                  const limits& limit, Onlooker& see, Build& build) {
    for (;;) {
        const auto end = run(system, m.at, m.so_far, limit, see);
        if (end.why != run_end::missing || end.code < 0 || !build(end.code)) return end.why;
    }
}

} // namespace detail

// Run a member to the end of its window, or to the first event from the time `until` on: then the
// answer is run_end::observer.
template <class Flow, class Build>
VI_HD inline run_end run_until(const hybrid<Flow>& system, motion<double, Flow>& m, const window& w,
                               observers<Flow>& all, double until, Build& build) {
    onlooker<Flow> see{system, all, until};
    return detail::run_building(system, m, limits_of(w), see, build);
}

// From what time on tangents are carried along.
VI_HD inline double begin_of_tangents(const window& w) {
    return w.settle - aligning * w.observe;
}

// The rest of a member's window with tangents, in jets.
template <int W, class Flow, class Build>
VI_HD inline member_end finish_with_tangents(const hybrid<Flow>& system, motion<double, Flow>& m,
                                             const window& w, observers<Flow>& all,
                                             growth<W>& tangents, Build& build) {
    tangents.settle = w.settle;
    motion<jet<double, W>, Flow> j{with_tangents<W>(system, m.at, tangents.count), m.so_far};
    tangent_onlooker<Flow, W> see{{system, all, infinity()}, {system, tangents, j.at}};
    const run_end end = detail::run_building(system, j, limits_of(w), see, build);
    m = {detail::values(j.at, system.dimension(), system.contacts()), j.so_far};
    return end_of_member(end);
}

} // namespace vi
