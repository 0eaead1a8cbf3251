// The stroboscopic section: where the motion stands whenever the phase of the force has one value.
//
// Method      at the times first + k period, k = 0, 1, ..., from the beginning of the window on; a
//             ring keeps the last of them. An event at such a time comes before the state.
// Accuracy    of a flight (flow/); the times to rounding
#pragma once

#include "vibroimpact/observe/section.hpp"

namespace vi {

template <class Shape>
struct stroboscopic {
    double first = 0.0, period = infinity();
    long last = 0;
    section_point<Shape>* points = nullptr; // room for `last`
    long taken = 0;

    template <class Flow>
    VI_HD void see(const stretch<Flow>& s) {
        const auto& flow = s.system.modes[s.mode].flow;
        for (;; ++taken) {
            const double time = first + static_cast<double>(taken) * period;
            if (!(time < s.begin + s.duration)) return;
            const double since = max(time - s.begin, 0.0);
            points[taken % last] = {flow.flight(s.y, since), s.mode, time};
        }
    }

    VI_HD long kept() const { return taken < last ? taken : last; }
    // The i-th kept point in order of time.
    VI_HD const section_point<Shape>& operator[](long i) const {
        return points[(taken - kept() + i) % last];
    }
};

} // namespace vi
