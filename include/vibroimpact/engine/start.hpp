// Start of a motion: a trajectory in the free mode from positions, velocities and phases.
//
// Method      y by (2) of mode_coordinates.hpp. A contact touches if u lies on a stop within its
//             rounding. Its rate is taken from the velocities as given, which y has mixed with
//             larger numbers; within their rounding it is rest.
// Fails       a start may lie behind a stop, which the caller has to ask for: behind_stop
#pragma once

#include "vibroimpact/search/certified_flight.hpp"
#include "vibroimpact/system/mode_coordinates.hpp"

namespace vi {

// Gaps of a contact to its stops, and the rounding of the smaller one.
struct start_gap {
    double lower, upper, rounding;
};
template <class Flow>
VI_HD inline start_gap gap_at_start(const hybrid<Flow>& system,
                                    const trajectory<double, typename Flow::shape_type>& at,
                                    int contact) {
    const auto& g = system.modes[0].guards[contact];
    const int n = system.dimension();
    const double u = guard_value(g, 0, at.y, n);
    const double above = u - g.lower, below = g.upper - u;
    const double terms = terms_of(system, at, contact, 0);
    return {above, below, rounding_at(above < below ? g.lower : g.upper, terms)};
}

// Whether a contact lies behind a stop by more than rounding.
template <class Flow>
VI_HD inline bool behind_stop(const hybrid<Flow>& system,
                              const trajectory<double, typename Flow::shape_type>& at) {
    for (int i = 0; i < system.contacts(); ++i) {
        const auto gap = gap_at_start(system, at, i);
        if (min(gap.lower, gap.upper) < -gap.rounding) return true;
    }
    return false;
}

namespace detail {

template <class T, class Flow>
VI_HD inline void touch_at_start(const hybrid<Flow>& system, const mode_coordinates& p, int i,
                                 const T* v, trajectory<T, typename Flow::shape_type>& at) {
    const auto& g = system.modes[0].guards[i];
    const int n = system.dimension(), degrees = system.oscillators();
    const double u = plain(guard_value(g, 0, at.y, n));
    at.touching[i] = side_within(g, u, terms_of(system, at, i, 0));
    at.rate[i] = T(0.0);
    if (at.touching[i] == 0.0) return;
    T rate = T(0.0);
    double terms = 0.0;
    for (int k = 0; k < degrees; ++k) {
        double gradient = 0.0, size = 0.0; // du / dx_k
        for (int j = 0; j < n; ++j) {
            const double part = g.rows[0][j] * p.from_x[j * degrees + k];
            gradient += part;
            size += abs(part);
        }
        rate = rate + gradient * v[k];
        terms += size * abs(plain(v[k]));
    }
    if constexpr (!is_modal<Flow>) // the rate of a stop that moves
        for (int j = n - 2 * p.lines; j < n; ++j) {
            rate = rate + g.rows[1][j] * at.y[j];
            terms += abs(g.rows[1][j]) * abs(plain(at.y[j]));
        }
    at.rate[i] = -at.touching[i] * rate;
    if (abs(plain(rate)) <= 8.0 * degrees * unit_roundoff * terms)
        at.rate[i] = with_value(at.rate[i], 0.0);
}

} // namespace detail

// `p` of the free mode; one phase per forcing line. In place, but for contacts that the system has not:
// a copy would wait until all these numbers are written.
template <class T, class Flow>
VI_HD inline void start_at(const hybrid<Flow>& system, const mode_coordinates& p, const T* x,
                           const T* v, const T* phases,
                           trajectory<T, typename Flow::shape_type>& at) {
    at.mode = at.held = 0;
    at.flat = {};
    at.elements = {};
    if constexpr (Flow::shape_type::max_elements > 0)
        if (system.elements.count > 0) at.elements.code = no_states;
    at.y = from_physical(p, x, v, forcing_at(p, phases), system);
    for (int i = 0; i < system.contacts(); ++i)
        detail::touch_at_start(system, p, i, v, at);
}

} // namespace vi
