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
//     observe/observers.hpp         a member, a bit, and a line in see()
//     batch/arrays.hpp, member.hpp, results.hpp
//                                   its options, and a table for its results: hand over, write
//     src/bindings/batch_module.cpp, src/vibroimpact/ensembles/cuda/layout.py
//                                   read the options, make room for the table
//     src/vibroimpact/ensembles/kinds.py, observers.py
//                                   its name and options, and the variables of a dataset
//     tests/test_observers.py       its results against the record of the same motion
#pragma once

#include "vibroimpact/run.hpp"

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
};

// The flight that led from a trajectory to the next event, without what lies before `skip`. The
// mode is the one that settle() chooses there (impact/rest.hpp).
template <class Flow>
VI_HD inline stretch<Flow> flown(const hybrid<Flow>& system,
                                 trajectory<double, typename Flow::shape_type> from,
                                 double duration, double skip) {
    if (from.mode == 0) {
        const int code = closed_set(system, from);
        if (code > 0) enter_mode(system, from, code);
    }
    stretch<Flow> s{system, from.y, from.mode, duration};
    if (skip > 0.0) {
        s.y = system.modes[s.mode].flow.flight(s.y, min(skip, duration));
        s.duration = max(duration - skip, 0.0);
    }
    return s;
}

// Show a stretch step by step: look(y, span) with span at most one step.
template <class Flow, class Look>
VI_HD inline void march(const stretch<Flow>& s, const Look& look) {
    const auto& flow = s.system.modes[s.mode].flow;
    ladder<double, Flow> at(s.y);
    for (;; at.advance(flow)) {
        const double left = s.duration - at.steps() * flow.step;
        look(at.y, min(left, flow.step));
        if (!(left > flow.step)) return;
    }
}

} // namespace vi
