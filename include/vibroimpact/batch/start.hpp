// Where a member of a batch starts: its trajectory from positions, velocities and phases.
//
// Method      as system_of::begin of src/bindings/system_of.hpp, operation for operation
#pragma once

#include "vibroimpact/batch/build.hpp"

namespace vi {

namespace detail {

// Whether a start stands on a stop of contact i; its rate from the velocities as given.
template <class Flow>
VI_HD inline void touch_start(const hybrid<Flow>& system, const mode_coordinates& p, int i,
                              const double* v, trajectory<double, typename Flow::shape_type>& at) {
    const auto& free = system.modes[0];
    const auto& g = free.guards[i];
    const int n = system.dimension(), degrees = p.degrees;
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
    const auto free = coordinates_of(b, 0, s);
    const double *x = b.position + i * b.degrees, *v = b.velocity + i * b.degrees;
    trajectory<double, typename Flow::shape_type> at{};
    at.y = from_physical<Flow::max_dimension>(free, x, v, forcing_at(free, b.phases + i * b.lines),
                                              system.dimension());
    for (int k = 0; k < system.contacts(); ++k)
        detail::touch_start(system, free, k, v, at);
    return at;
}

} // namespace vi
