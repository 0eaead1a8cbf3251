// Prescribed motions as Python sees them.
#pragma once

#include <memory>
#include <vector>

#include "vibroimpact/orbit/prescribed.hpp"

namespace binding {

using numbers = std::vector<double>;

// A number and its derivatives with respect to the parameter: f, f', f'', f'''.
inline constexpr int parameter_orders = 4;

// Arrays of such numbers, the order of the derivative first: order * size + index.
struct prescribed_data {
    int degrees, dimension;
    numbers ratios;
    double rate;
    numbers omega; // 1
    struct mode {
        numbers field, constant; // D x D, D
        double step;
    };
    struct stop {
        numbers row, limit, impulse, restitution, kick; // D, 1, D, 1, D
        int mode;                                       // in which it is reached
        bool chatters;
    };
    std::vector<mode> modes;
    std::vector<stop> stops;
};

// Segments: states (count, 2n + 1) after an event, flight times, the stop that ends each.
struct segments {
    numbers states, durations;
    std::vector<int> stops;
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

// Start and end of a map: put on a stop by solving for one coordinate (or stop = -1), and after
// the last event or after a whole time, given with its derivatives, which ends in a mode.
struct ends {
    int stop, solved;
    numbers period;
    int mode;
};

class prescribed {
public:
    explicit prescribed(prescribed_data data) : data_(std::move(data)) {}

    linearised linearise(const segments& s) const;
    // Second derivatives of the state after each segment, (count, 2n + 1, 2n + 3), and of the gap at
    // its end, (count, 2n + 3): along one direction of the state and the time, (count, 2n + 2), and
    // by every number that `linearised` differentiates by.
    second_order second(const segments& s, const numbers& directions) const;
    // Coefficients of all products of the directions (count, 2n + 2), of the state at the end and of
    // the elapsed time: (2^count, 2n + 2).
    numbers forms(const segments& s, const ends& e, const numbers& directions, int count) const;
    // Flights within chatter at a stop: states (count, 2n + 1) after its impacts and times (count,), with
    // their derivatives along a direction (2n + 2,) of the first state and the parameter.
    chatter_flights chatter(const numbers& state, const numbers& direction, int stop) const;
    // Flights from each state in a mode over a number of equal windows, at nodes in each:
    // (all windows, nodes, 2n) of x and v.
    numbers fly(const numbers& states, const std::vector<int>& modes,
                const std::vector<int>& windows, const numbers& nodes, double window) const;

    std::size_t degrees() const { return static_cast<std::size_t>(data_.degrees); }

private:
    prescribed_data data_;
};

} // namespace binding
