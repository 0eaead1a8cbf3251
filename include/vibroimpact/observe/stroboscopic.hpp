// The stroboscopic section: where the motion stands whenever the phase of the force has one value.
//
// Method      at the times first + k period, k = 0, 1, ..., from the beginning of the window on; a
//             ring keeps the last of them, and those of a flight that it would lose again are left out.
//             An event at such a time comes before the state.
// Accuracy    of a flight (flow/); the times to rounding
// Fails       no points without forcing
#pragma once

#include "vibroimpact/observe/section_points.hpp"

namespace vi::observe {

inline constexpr double largest_skip = 9e18; // fits a count

struct stroboscopic {
    static constexpr const char* name = "stroboscopic";
    long points = 1;
    double phase = 0.0;
    point_tables results{};

    void options(const auto& to) {
        to.count("points", points, 1, largest_count);
        to.real("phase", phase);
    }
    void tables(const batch_sizes& n, const auto& to) { results.declare(points, n, to); }
    long long borrows() const { return points; }
    template <class Flow>
    struct observer;
};

template <class Flow>
struct stroboscopic::observer : point_ring<Flow> {
    double first = 0.0, period = infinity();

    // The force has the phase after so much of a turn, and once every period from then on.
    VI_HD void prepare(const stroboscopic& options, const member_start<Flow>& m) {
        this->room = options.points;
        period = 2.0 * pi / m.omega;
        const double turn = (options.phase - m.phase) / (2.0 * pi);
        const double earliest = (turn - floor(turn)) * period;
        const double skipped = floor((m.settle - earliest) / period);
        first = earliest + skipped * period;
        if (first < m.settle) first = earliest + (skipped + 1.0) * period;
    }
    VI_HD void on_flight(const flight_segment<Flow>& s) {
        const auto& flow = s.system.modes[s.mode].flow;
        const double end = s.begin + s.duration;
        const double lost = floor((end - first) / period) - static_cast<double>(this->taken) -
                            static_cast<double>(this->room) - 1.0;
        if (lost > 0.0) this->taken += static_cast<long>(min(lost, largest_skip));
        for (long shown = 1;; ++shown) {
            const double time = first + static_cast<double>(this->taken) * period;
            if (!(time < end)) return;
            if (shown % steps_in_a_row == 0 && s.interrupted && s.interrupted()) return;
            this->keep({flow.flight(s.y, max(time - s.begin, 0.0)), s.mode, time});
        }
    }
    VI_HD void write(const auto& m, const stroboscopic& to) const {
        this->write_points(m, to.results);
    }
};

} // namespace vi::observe
