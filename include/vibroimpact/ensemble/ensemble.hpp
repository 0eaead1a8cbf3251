// One member of an ensemble: a trajectory over a window of time, shown to observers.
//
// Method      From t = 0 the motion runs settle + observe units of time; the flight in progress at
//             the end is cut there. Observers (observe/) see what lies after `settle`; the flight
//             that is under way at that time counts from there on.
//             Where tangents are wanted, the motion goes on in jets from a quarter of the observed
//             time before the window. Values of jets have the bits of doubles; only what is known of
//             flights that repeat (search/grid/recall_period.hpp) is forgotten there.
//             Where a flight has made several tangents parallel (growth.hpp), all but the first fly it
//             again in pieces, orthonormal after each; the last piece brings the event.
// Accuracy    that of the engine: the same bits for the same system and start, whatever else runs
// Fails       member_end: every outcome is data. Results are of the whole window or none
#pragma once

#include "vibroimpact/observe/growth.hpp"
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
    diverged = 8,            // the state is so large that nothing can be decided; 7 is the host's
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

namespace detail {

// After a piece of some steps the fastest part is left by exp(-6) or more, and directions keep their digits.
inline constexpr double steps_of_piece = 8.0;

// Tangents without their parts along the flow, which an event takes away: what would be left of a vector
// that a long flight has turned into the flow is rounding.
template <int W, class Flow>
VI_HD inline void leave_out_flow(const Flow& flow, vec<jet<double, W>, Flow::max_dimension>& y,
                                 int n, int count) {
    const auto f = flow.derivative(values_of(y, n));
    double square = 0.0;
    for (int i = 0; i < n; ++i)
        square = square + f[i] * f[i];
    for (int k = 0; square > 0.0 && k < count; ++k) {
        double along = 0.0;
        for (int i = 0; i < n; ++i)
            along = along + f[i] * y[i].d[k];
        for (int i = 0; i < n; ++i)
            y[i].d[k] = y[i].d[k] - along / square * f[i];
    }
}

// Elements whose margins grow have left their limits; what stays on one goes on to do so.
template <int Watches>
VI_HD inline void leave_limits(element_states<Watches>& states) {
    if constexpr (Watches > 0)
        for (int j = 0; j < Watches; ++j)
            if (!states.stays_on(j)) states.zeros[j] = 0;
}

// The flight from a trajectory to its event, which left it `at`: the tangents of that but the first, by
// way of pieces, whose growth is the answer. Nothing is changed where they do not lead to that event.
template <int W, class Flow>
VI_CALL growth<W> in_pieces(const hybrid<Flow>& system,
                            trajectory<jet<double, W>, typename Flow::shape_type> from,
                            const event<jet<double, W>, typename Flow::shape_type>& e,
                            trajectory<jet<double, W>, typename Flow::shape_type>& at, int count) {
    const int n = system.dimension(), contacts = system.contacts();
    const auto& flow = system.modes[from.mode].flow;
    const double duration = plain(e.duration), piece = steps_of_piece * flow.step;
    const long pieces = static_cast<long>(duration / piece - 0.5); // 1/2 to 3/2 of one are left
    growth<W> sums, none;
    sums.count = count;
    sums.events = 1.0; // every growth counts, also that of leaving out the flow
    if (pieces < 1) return none;

    const double flown = static_cast<double>(pieces) * piece;
    const auto there = flow.flight(values_of(from.y, n), flown);
    const auto once = flow.at_time(piece);
    const auto see = [&] {
        // rounding brings in other amplitudes of the forcing, which never fade
        renormalise_forcing(from.y, n, system.lines(), system.inverse_omega_squared);
        leave_out_flow<W>(flow, from.y, n, count);
        sums.see(true, from, 0.0, n, contacts);
    };
    see();
    for (long i = 0; i < pieces; ++i) {
        from.y = flow.apply(once, from.y);
        see();
    }
    for (int i = 0; i < n; ++i)
        from.y[i].v = there[i];
    for (int i = 0; i < contacts; ++i)
        if (side_in_code(from.held, i) == 0.0) from.touching[i] = 0.0;
    leave_limits(from.elements);
    const auto last = step(system, from, duration - flown + piece);
    const bool same = last.what == e.what && last.contact == e.contact && last.side == e.side &&
                      from.mode == at.mode && from.held == at.held;
    if (!same || !(abs(plain(last.duration) - (duration - flown)) < 0x1p-20 * flow.step))
        return none;
    for (int k = 1; k < count; ++k) {
        for (int i = 0; i < n; ++i)
            at.y[i].d[k] = from.y[i].d[k];
        for (int i = 0; i < contacts; ++i)
            at.rate[i].d[k] = from.rate[i].d[k];
    }
    return sums;
}

} // namespace detail

// What a run shows its events to: tangents if there are any, then the observers.
template <class Flow, int W>
struct onlooker {
    using Shape = typename Flow::shape_type;
    const hybrid<Flow>& system;
    observers<Flow>& all;
    growth<W>& tangents;
    double until; // the run is left after the first event from this time on
    trajectory<jet<double, W>, Shape> last{}; // where the flight to the next event begins

    VI_HD bool see(const event<double, Shape>& e, const trajectory<double, Shape>& at,
                   const clock& now) {
        all.on_event(system, e, at, now);
        return now.time() < until;
    }
    VI_HD bool see(const event<jet<double, W>, Shape>& e, trajectory<jet<double, W>, Shape>& at,
                   const clock& now) {
        const int n = system.dimension(), contacts = system.contacts();
        if constexpr (W > 1)
            follow(e, at, now, n, contacts);
        else
            tangents.see(e, at, now, n, contacts);
        return see(detail::values(e, n), detail::values(at, n, contacts), now);
    }

private:
    VI_HD void follow(const event<jet<double, W>, Shape>& e, trajectory<jet<double, W>, Shape>& at,
                      const clock& now, int n, int contacts) {
        auto tried = at;
        auto grown = tangents;
        grown.see(e, tried, now, n, contacts);
        if (grown.lost) {
            const auto pieces = detail::in_pieces(system, last, e, at, tangents.count);
            const bool counted = now.time() >= tangents.settle && tangents.events > 0.0;
            tangents.see(e, at, now, n, contacts);
            for (int k = 1; counted && k < tangents.count; ++k)
                tangents.sum[k] = tangents.sum[k] + pieces.sum[k];
        } else {
            tangents = grown;
            at = tried;
        }
        tangents.lost = false;
        last = at;
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
    growth<1> none;
    onlooker<Flow, 1> see{system, all, none, until, {}};
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
    onlooker<Flow, W> see{system, all, tangents, infinity(), j.at};
    const run_end end = detail::run_building(system, j, limits_of(w), see, build);
    m = {detail::values(j.at, system.dimension(), system.contacts()), j.so_far};
    return end_of_member(end);
}

} // namespace vi
