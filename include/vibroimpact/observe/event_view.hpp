// View of a motion for observers: its events, and the flights between them.
#pragma once

#include "vibroimpact/engine/run.hpp"

namespace vi {

// One event inside the window.
template <class Flow>
struct event_view {
    using shape_type = typename Flow::shape_type;
    const hybrid<Flow>& system;
    const event<double, shape_type>& e;
    const trajectory<double, shape_type>& at; // after the event
    double time;                              // of the event, since the start of the run
};

// The part of one flight that lies inside the window.
template <class Flow>
struct flight_segment {
    const hybrid<Flow>& system;
    vec<double, Flow::max_dimension> y; // where it starts, in the coordinates of its mode
    int mode;
    double duration;
    double begin;                    // time, since the start of the run
    bool (*interrupted)() = nullptr; // called now and then; true: the results will not be used
};

// The flight that led from a trajectory to the next event, without what lies before `skip`; the event
// is at `end`.
template <class Flow>
VI_HD inline flight_segment<Flow>
segment_before_event(const hybrid<Flow>& system,
                     const trajectory<double, typename Flow::shape_type>& from, double duration,
                     double skip, double end, bool (*interrupted)()) {
    flight_segment<Flow> s{system, from.y, from.mode, duration, end - duration, interrupted};
    if (skip > 0.0) {
        s.y = system.modes[s.mode].flow.flight(s.y, min(skip, duration));
        s.duration = max(duration - skip, 0.0);
        s.begin = end - s.duration;
    }
    return s;
}

// Go through a segment step by step: look(y, span) with span at most one step.
template <class Flow, class Look>
VI_HD inline void march(const flight_segment<Flow>& s, const Look& look) {
    const auto& flow = s.system.modes[s.mode].flow;
    refreshed_march<double, Flow> at(s.y);
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
