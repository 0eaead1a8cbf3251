// Where a member of a batch starts: its trajectory from positions, velocities and phases.
//
// Method      as system_of::begin of src/bindings/system_of.hpp, operation for operation
#pragma once

#include "vibroimpact/batch/build.hpp"

namespace vi {

namespace detail {

// Free coordinates of (x, v, phases of the lines).
template <int D>
VI_HD inline vec<double, D> free_coordinates(const mode_coordinates& p, const double* x,
                                             const double* v, const double* phases,
                                             const double* kappas, int n, int degrees, int lines) {
    double waves[2 * max_lines];
    for (int l = 0; l < lines; ++l) {
        const auto wave = sincos(phases[l]);
        waves[2 * l] = wave.s;
        waves[2 * l + 1] = kappas[l] * wave.c;
    }
    vec<double, D> y{};
    for (int i = 0; i < n; ++i) {
        double sum = 0.0;
        for (int k = 0; k < degrees; ++k)
            sum = sum + p.from_x[i * degrees + k] * (x[k] - p.offset[k]) +
                  p.from_v[i * degrees + k] * v[k];
        for (int l = 0; l < lines; ++l)
            sum = sum + p.particular[i * 2 * lines + 2 * l] * waves[2 * l] +
                  p.particular[i * 2 * lines + 2 * l + 1] * waves[2 * l + 1];
        y[i] = sum;
    }
    for (int l = 0; l < 2 * lines; ++l)
        y[n - 2 * lines + l] = waves[l];
    return y;
}

// Whether a start stands on a stop of contact i; its rate from the velocities as given.
template <class Flow>
VI_HD inline void touch_start(const hybrid<Flow>& system, const mode_coordinates& p, int i,
                              const double* v, int degrees,
                              trajectory<double, typename Flow::shape_type>& at) {
    const auto& free = system.modes[0];
    const auto& g = free.guards[i];
    const int n = system.dimension();
    const double u = watch(g, 0, at.y, n);
    at.touching[i] = side_within(g, u, magnitude(g, 0, at.y, n, free.flow.step));
    double rate = 0.0, terms = 0.0;
    for (int k = 0; k < degrees; ++k) {
        double gradient = 0.0;
        for (int j = 0; j < n; ++j)
            gradient += g.rows[0][j] * p.from_x[j * degrees + k];
        rate = rate + gradient * v[k];
        terms += abs(gradient * v[k]);
    }
    at.rate[i] = -at.touching[i] * rate;
    if (abs(rate) <= 8.0 * degrees * unit_roundoff * terms) at.rate[i] = 0.0;
}

} // namespace detail

// The start of member i, in the free mode.
template <class Flow>
VI_CALL trajectory<double, typename Flow::shape_type>
start_of(const batch_arrays& b, const hybrid<Flow>& system, long long i) {
    const long long s = b.system[i];
    const int degrees = static_cast<int>(b.degrees), lines = static_cast<int>(b.lines);
    const auto free = coordinates_of(b, 0, s);
    const double *x = b.position + i * degrees, *v = b.velocity + i * degrees;
    trajectory<double, typename Flow::shape_type> at{};
    at.y = detail::free_coordinates<Flow::max_dimension>(
        free, x, v, b.phases + i * lines, b.kappas + s * lines, system.dimension(), degrees, lines);
    for (int k = 0; k < system.contacts(); ++k)
        detail::touch_start(system, free, k, v, degrees, at);
    return at;
}

} // namespace vi
