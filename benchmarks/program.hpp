// The frame of every C++ program here: read starts, simulate, time, write impact times.
//
// Input     doubles in native byte order, on standard input:
//             mass_ratio omega_n zeta restitution half_clearance omega force n_starts impacts
//             per start: x1 x2 v1 v2 phase contact    (contact: +1 stop A, -1 stop B, 0 none)
// Output    doubles, on standard output:
//             seconds
//             per start: `impacts` times since the start, NaN from the first that was not found
// Timing    a steady clock around the simulation of all starts; reading and writing excluded.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <vector>

namespace benchmark {

inline constexpr double longest_flight = 1e4; // a flight without contact for this long is given up
inline constexpr double none = std::numeric_limits<double>::quiet_NaN();

struct Parameters {
    double mass_ratio, omega_n, zeta, restitution, half_clearance, omega, force;
};

struct Start {
    double x1, x2, v1, v2, phase, contact;
};

struct Task {
    Parameters parameters;
    std::size_t impacts;
    std::vector<Start> starts;
};

template <class T>
bool read(T* into, std::size_t count) {
    return std::fread(into, sizeof(T), count, stdin) == count;
}

inline bool read_task(Task& task) {
    double counts[2];
    if (!read(&task.parameters, 1) || !read(counts, 2)) return false;
    task.impacts = static_cast<std::size_t>(counts[1]);
    task.starts.resize(static_cast<std::size_t>(counts[0]));
    return read(task.starts.data(), task.starts.size());
}

// `simulate(start, impacts, times)` fills times[0 .. impacts); `prepare(parameters)` makes it,
// untimed.
template <class Prepare>
int run(Prepare prepare) {
    Task task;
    if (!read_task(task)) return 2;
    std::vector<double> times(task.starts.size() * task.impacts, none);
    const auto simulate = prepare(task.parameters);
    const auto begin = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < task.starts.size(); ++i) {
        simulate(task.starts[i], task.impacts, times.data() + i * task.impacts);
    }
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
    const double seconds = spent.count();
    std::fwrite(&seconds, sizeof seconds, 1, stdout);
    std::fwrite(times.data(), sizeof(double), times.size(), stdout);
    return 0;
}

} // namespace benchmark
