// Prescribed motions as Python sees them.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "vibroimpact/orbit/prescribed.hpp"

namespace binding {

using numbers = std::vector<double>;

// A number and its derivatives with respect to the parameter: f, f', f'', f'''.
inline constexpr int parameter_orders = 4;

// A compiled system. Its numbers are those of omega (1), of every mode the field (D x D) and the
// constant (D), of every stop row (D), limit (1), impulse (D), restitution (1) and kick (D), and the maps (D x D)
// that some stops have; others may follow. They stand in rows by the order of the derivative.
struct prescribed_data {
    int degrees, dimension;
    numbers ratios;
    double rate;
    numbers steps; // of each mode
    struct stop {
        int mode; // in which it is reached
        bool chatters;
        int map; // its number, -1: none
    };
    std::vector<stop> stops;
    numbers values;
    std::size_t count; // of the numbers: from one order to the next

    const double* field(std::size_t mode) const {
        return values.data() + 1 + mode * width() * (width() + 1);
    }
    const double* constant(std::size_t mode) const { return field(mode) + width() * width(); }
    const double* of_stop(std::size_t stop) const {
        return field(steps.size()) + stop * (3 * width() + 2);
    }
    const double* of_map(std::size_t map) const {
        return of_stop(stops.size()) + map * width() * width();
    }
    std::size_t width() const { return static_cast<std::size_t>(dimension); }
    // All that modes and stops take.
    std::size_t least_count() const {
        int last = -1;
        for (const auto& one : stops)
            last = std::max(last, one.map);
        return static_cast<std::size_t>(of_map(static_cast<std::size_t>(last + 1)) - values.data());
    }
};

// Segments: states (count, 2n + 1) after an event, flight times, the stop that ends each.
struct segments {
    numbers states, durations;
    std::vector<int> stops;
    int count() const { return static_cast<int>(durations.size()); }
};

struct linearised {
    numbers after, before;         // (count, 2n + 1)
    numbers gap, rate, rate_after; // (count,)
    numbers after_by;              // (count, 2n + 1, 2n + 3): by the state, the time, the parameter
    numbers gap_by;                // (count, 2n + 3)
};

struct second_order {
    numbers after_by, gap_by; // as in `linearised`
};

struct chatter_flights {
    numbers states, durations, states_by, durations_by;
};

// Guards of flights, each u = row . y + gain in a mode: where their rows stand among the numbers.
struct guards {
    std::vector<int> modes, rows;
    std::size_t count() const { return modes.size(); }
};

// How guards go along flights, over windows of Chebyshev nodes.
struct approaches {
    numbers extrema; // (count, 4): guard, segment, time since its start, value
    numbers edges;   // (guards, segments, 4): value and rate at the start, and at the end
    numbers sizes;   // (guards, 2): largest sum of the moduli of the terms, and of the rates
    numbers most;    // (D,): largest moduli of the coordinates y
};

// Start and end of a map: put on a stop by solving for one coordinate (or stop = -1), and after
// the last event or after a whole time, given with its derivatives, which ends in a mode.
struct ends {
    int stop, solved;
    numbers period;
    int mode;
};

class prescribed {
public:
    // What is computed, in arrays of any shape.
    struct motions {
        virtual ~motions() = default;
        virtual linearised linearise(const segments& s) const = 0;
        // Second derivatives of the state after each segment, (count, 2n + 1, 2n + 3), and of the gap
        // at its end, (count, 2n + 3): along one direction of the state and the time, (count, 2n + 2),
        // and by every number that `linearise` differentiates by, or by the parameter alone.
        virtual second_order second(const segments& s, const numbers& directions,
                                    bool by_parameter) const = 0;
        // Coefficients of all products of the directions (count, 2n + 2), of the state at the end and
        // of the elapsed time: (2^count, 2n + 2).
        virtual numbers forms(const segments& s, const ends& e, const numbers& directions,
                              int count) const = 0;
        // Derivatives of the guard of a stop by (x, v, theta) at a phase: (2n + 1,).
        virtual numbers slopes(int stop, double phase) const = 0;
        // Position, or velocity, that its section leaves out: the last largest of its row; the phase where it
        // depends on nothing else, and -1 where a reset follows.
        virtual int solved_coordinate(int stop) const = 0;
        // Flights within chatter at a stop: states (count, 2n + 1) after its impacts and times
        // (count,), with their derivatives along a direction (2n + 2,) of the first state and the
        // parameter.
        virtual chatter_flights chatter(const numbers& state, const numbers& direction,
                                        int stop) const = 0;
        // Flights from each state in a mode over a number of equal windows, at nodes in each:
        // (all windows, nodes, 2n) of x and v.
        virtual numbers fly(const numbers& states, const std::vector<int>& modes,
                            const std::vector<int>& windows, const numbers& nodes,
                            double window) const = 0;
        // Extrema of guards in flights from each state in a mode. Coefficients of rates below `flat` of the
        // largest are left out.
        virtual approaches approach(const numbers& states, const numbers& durations,
                                    const std::vector<int>& modes, const guards& g,
                                    const numbers& nodes, double window, double flat) const = 0;
    };

    explicit prescribed(prescribed_data data);
    std::size_t dimension() const { return dimension_; }
    const motions* operator->() const { return motions_.get(); }
    std::size_t degrees() const { return static_cast<std::size_t>(degrees_); }

private:
    int degrees_;
    std::size_t dimension_;
    std::unique_ptr<motions> motions_;
};

} // namespace binding
