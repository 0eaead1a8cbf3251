// The last points of a section: a ring of states, and their rows of results.
#pragma once

#include "vibroimpact/observe/observer.hpp"

namespace vi {

template <class Shape>
struct section_point {
    vec<double, Shape::max_dimension> y; // in the coordinates of the mode that follows
    int mode;
    double time;
};

struct point_tables {
    result_table position{}, velocity{}, phase{}, time{};

    void declare(long long points, const batch_sizes& n, const auto& to) {
        to("position", position, points * n.degrees);
        to("velocity", velocity, points * n.degrees);
        to("phase", phase, points);
        to("time", time, points);
    }
};

template <class Flow>
struct point_ring {
    using element = section_point<typename Flow::shape_type>;
    element* memory = nullptr; // room for so many:
    long room = 1, taken = 0;

    VI_HD void keep(const element& point) { memory[taken++ % room] = point; }

    // The kept points in order of time.
    VI_HD void write_points(const auto& m, const point_tables& to) const {
        const long kept = taken < room ? taken : room;
        for (long j = 0; j < kept; ++j) {
            const auto& point = memory[(taken - kept + j) % room];
            m.write_state(point.mode, point.y, to.position.row(m.row) + j * m.degrees(),
                          to.velocity.row(m.row) + j * m.degrees(), to.phase.row(m.row) + j);
            to.time.row(m.row)[j] = point.time;
        }
    }
};

} // namespace vi
