// The impact section: where the motion stands just after the impacts at one stop.
//
// Method      every stride-th impact at the stop, from the first in the window on; a ring keeps the
//             last of them
#pragma once

#include "vibroimpact/observe/event_view.hpp"

namespace vi {

template <class Shape>
struct section_point {
    vec<double, Shape::max_dimension> y; // in the coordinates of the mode that follows
    int mode;
    double time;
};

template <class Shape>
struct section {
    int contact = 0, side = upper_side;
    long last = 0, stride = 1;
    section_point<Shape>* points = nullptr; // room for `last`
    long seen = 0;                          // impacts at the stop

    template <class Flow>
    VI_HD void see(const scene<Flow>& s) {
        if (!counts_as_impact(s.e.what) || s.e.contact != contact || s.e.side != side) return;
        if (seen % stride == 0) points[seen / stride % last] = {s.at.y, s.at.mode, s.time};
        ++seen;
    }

    VI_HD long taken() const { return (seen + stride - 1) / stride; }
    VI_HD long kept() const { return taken() < last ? taken() : last; }
    // The i-th kept point in order of time.
    VI_HD const section_point<Shape>& operator[](long i) const {
        return points[(taken() - kept() + i) % last];
    }
};

} // namespace vi
