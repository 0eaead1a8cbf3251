// What an observer is shown: an event, what was flown before it, where the motion stands after it.
//
// An observer is a plain struct with options, results, and
//
//     template <class Flow> VI_HD void see(const scene<Flow>& s);        of every event, or
//     template <class Flow> VI_HD void see(const stretch<Flow>& s);      of every flight
//
// without heap, library or exceptions; memory of variable size is lent by the caller. To add one:
//
//     observe/                      its struct, in a file of its own
//     observe/observers.hpp         include, a bit after the last, a member, a line in see() of
//                                   events or of flights; sees_flights if it wants flights
//     ensemble/arrays.hpp              its options, and a table for its results
//     ensemble/member.hpp              prepare_observers(): options, the window, lent memory
//     ensemble/results.hpp             clear() and write(): the numbers of a row
//     src/bindings/owned_arrays.hpp read(): options, by the names that kernel_observers gives; the
//                                   width of the table, in results
//     src/vibroimpact/sweeps/execution/cuda/layout.py
//                                   the same for devices: SEEN, in the order of the bits; _options,
//                                   _widths
//     src/vibroimpact/sweeps/observers/kinds.py
//                                   name, options with their checks, variables by table and column
//     src/vibroimpact/sweeps/observers/observer.py
//                                   OBSERVERS; options whose names differ, in kernel_observers
//     tests/sweeps/test_observers.py       its results against the record of the same motion; EVERYTHING
//                                   of tests/sweeps/test_cuda.py compares the two hosts
//     docs/sweeps.md                a row of the table of observers
//
// Without options and with one number, as power.hpp, most of these are one line. The observer
// rotation.hpp has both; its name finds every place.
#pragma once

#include "vibroimpact/engine/run.hpp"

namespace vi {

// One event inside the window.
template <class Flow>
struct scene {
    using shape_type = typename Flow::shape_type;
    const hybrid<Flow>& system;
    const event<double, shape_type>& e;
    const trajectory<double, shape_type>& at; // after the event
    double time;                              // of the event, since the start of the run
};

// The part of one flight that lies inside the window.
template <class Flow>
struct stretch {
    const hybrid<Flow>& system;
    vec<double, Flow::max_dimension> y; // where it starts, in the coordinates of its mode
    int mode;
    double duration;
    double begin;                    // time, since the start of the run
    bool (*interrupted)() = nullptr; // asked now and then; true: what is seen is of no use any more
};

// The flight that led from a trajectory to the next event, without what lies before `skip`; the event
// is at `end`.
template <class Flow>
VI_HD inline stretch<Flow> flown(const hybrid<Flow>& system,
                                 const trajectory<double, typename Flow::shape_type>& from,
                                 double duration, double skip, double end, bool (*interrupted)()) {
    stretch<Flow> s{system, from.y, from.mode, duration, end - duration, interrupted};
    if (skip > 0.0) {
        s.y = system.modes[s.mode].flow.flight(s.y, min(skip, duration));
        s.duration = max(duration - skip, 0.0);
        s.begin = end - s.duration;
    }
    return s;
}

// Show a stretch step by step: look(y, span) with span at most one step.
template <class Flow, class Look>
VI_HD inline void march(const stretch<Flow>& s, const Look& look) {
    const auto& flow = s.system.modes[s.mode].flow;
    ladder<double, Flow> at(s.y);
    for (int shown = 1;; at.advance(flow), ++shown) {
        const double left = s.duration - at.steps() * flow.step;
        look(at.y, min(left, flow.step));
        if (!(left > flow.step)) return;
        if (shown < steps_in_a_row) continue;
        shown = 0;
        if (s.interrupted && s.interrupted()) return;
    }
}

} // namespace vi
