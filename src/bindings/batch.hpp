// Many systems of one structure, the members that run in them, and what was observed.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "system.hpp"

namespace binding {

// What _kernel.System is told, with a leading axis: one entry per system.
struct batch_mode {
    int code;
    numbers k, c, a;     // modal
    numbers b, constant; // dense
    numbers rows, gains, lower, upper;
    std::vector<int> side; // the same for all systems
    numbers to_x, to_v, offset, from_x, from_v, particular;
};
struct batch_data {
    bool dense;
    std::size_t count, dimension, degrees, lines, contacts;
    numbers omegas, kappas, steps, impulse, mobility, shift, restitution;
    std::vector<batch_mode> modes; // modes[0] is free
};

system_data system_at(const batch_data& batch, std::size_t s);
mode_data mode_at(const batch_data& batch, const batch_mode& mode, std::size_t s);

struct members {
    std::vector<std::int32_t> system; // index into the batch
    numbers position, velocity, phases, settle, observe;
    long most_impacts;
    bool (*interrupted)();

    std::size_t count() const { return system.size(); }
};

// Which observers are wanted, and their options; see ensembles/observers.py.
struct observer_options {
    unsigned wanted = 0; // observer_bit
    bool lyapunov = false, spectrum = false, final_state = false;
    int contact = 0, side = 1;
    long last = 1, stride = 1;
    double symbol_tolerance = 0.0, settling_tolerance = 0.0;
    long symbol_returns = 1, settling_returns = 1, longest = 1;
    numbers extremes, averages; // rows on the coordinates, row-major
};

// One row of numbers per member; width 0: not wanted.
struct table {
    const char* name;
    std::size_t width = 0;
    numbers values{};

    double* row(std::size_t i) { return values.data() + i * width; }
};
struct observed {
    std::vector<std::int8_t> end; // member_end
    table time{"time"};
    table section_position{"section_position"}, section_velocity{"section_velocity"};
    table section_phase{"section_phase"}, section_time{"section_time"};
    table symbol{"symbol"};   // n, p, q
    table impacts{"impacts"}; // at A, at B, per forcing period
    table speeds{"speeds"};   // mean, rms, smallest, largest
    table power{"power"};
    table settling{"settling"};
    table extremes{"extremes"}; // smallest, largest of every row
    table averages{"averages"}; // mean, root mean square of every row
    table shares{"shares"};     // time at rest
    table counts{"counts"};     // completed chatter, grazes
    table lyapunov{"lyapunov"}, spectrum{"spectrum"};
    table final_position{"final_position"}, final_velocity{"final_velocity"};
    table final_phase{"final_phase"};

    observed(const batch_data& batch, const observer_options& options, std::size_t members);

    // f(table) for every table.
    template <class F>
    void each(const F& f) {
        for (auto* t :
             {&time, &section_position, &section_velocity, &section_phase, &section_time, &symbol,
              &impacts, &speeds, &power, &settling, &extremes, &averages, &shares, &counts,
              &lyapunov, &spectrum, &final_position, &final_velocity, &final_phase})
            f(*t);
    }
};

observed run_modal_small(const batch_data&, const members&, const observer_options&);
observed run_modal(const batch_data&, const members&, const observer_options&);
observed run_dense(const batch_data&, const members&, const observer_options&);

} // namespace binding
