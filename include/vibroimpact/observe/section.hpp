// The impact section: where the motion stands just after the impacts at one stop.
//
// Method      every stride-th impact at the stop, from the first in the window on; a ring keeps the
//             last of them
#pragma once

#include "vibroimpact/observe/section_points.hpp"

namespace vi::observe {

struct section {
    static constexpr const char* name = "section";
    long points = 1, stride = 1, contact = 0;
    int stop = upper_side;
    point_tables results{};

    void options(const auto& to) {
        to.count("points", points, 1, largest_count);
        to.count("stride", stride, 1, largest_count);
        to.count("contact", contact, 0, no_limit);
        to.stop("stop", stop);
    }
    void tables(const batch_sizes& n, const auto& to) { results.declare(points, n, to); }
    long long borrows() const { return points; }
    template <class Flow>
    struct observer;
};

template <class Flow>
struct section::observer : point_ring<Flow> {
    section declared{};
    long seen = 0; // impacts at the stop

    VI_HD void prepare(const section& options, const member_start<Flow>&) {
        declared = options;
        this->room = options.points;
    }
    VI_HD void on_event(const event_view<Flow>& s) {
        if (!counts_as_impact(s.e.what) || s.e.contact != declared.contact ||
            s.e.side != declared.stop)
            return;
        if (seen++ % declared.stride == 0) this->keep({s.at.y, s.at.mode, s.time});
    }
    VI_HD void write(const auto& m, const section& to) const { this->write_points(m, to.results); }
};

} // namespace vi::observe
