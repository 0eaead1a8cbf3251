// Two states compared, relative to their size.
//
// Method      size = the largest of |x_i| and |v_i| / w of both states, w a frequency, with the
//             velocities before their events: where the stop is at zero and a mass does not
//             rebound, all that is left of x and v is rounding                            (1)
//             they agree if positions differ by at most tolerance * size, velocities by
//             tolerance * w * size, sine and cosine of each forcing line by tolerance     (2)
#pragma once

#include "vibroimpact/observe/observer.hpp"

namespace vi {

// Units in which states are compared.
struct physical_rows {
    mode_coordinates free{};
    double frequency = 1.0; // w of (1)
};

// x, v, then the forcing pairs (sin, cos).
template <int D>
struct physical_state {
    vec<double, D> of;
    double size; // (1) of this one
};

template <class Flow>
VI_HD inline physical_state<Flow::max_dimension> physical(const physical_rows& rows,
                                                          const event_view<Flow>& s) {
    const auto& p = rows.free;
    const int n = s.system.dimension();
    const auto y = in_free_coordinates(s.system, s.at);
    const double per_frequency = 1.0 / rows.frequency;
    physical_state<Flow::max_dimension> out{};
    for (int i = 0; i < p.degrees; ++i) {
        const double x = position_of(p, i, y, n), v = velocity_of(p, i, y, n);
        const double faster = max(abs(v), abs(velocity_of(p, i, s.e.before, n)));
        out.of[i] = x;
        out.of[p.degrees + i] = v;
        out.size = max(out.size, max(abs(x), per_frequency * faster)); // (1)
    }
    for (int l = 0; l < p.lines; ++l) {
        out.of[2 * (p.degrees + l)] = sine_of(p, l, y, n);
        out.of[2 * (p.degrees + l) + 1] = cosine_of(p, l, y, n);
    }
    return out;
}

// (2)
template <int D>
VI_HD inline bool same_state(const physical_state<D>& a, const physical_state<D>& b,
                             const physical_rows& rows, double tolerance) {
    const int n = rows.free.degrees, lines = rows.free.lines;
    for (int i = 2 * n; i < 2 * (n + lines); ++i)
        if (!(abs(a.of[i] - b.of[i]) <= tolerance)) return false;
    double apart = 0.0;
    const double per_frequency = 1.0 / rows.frequency;
    for (int i = 0; i < 2 * n; ++i)
        apart = max(apart, (i < n ? 1.0 : per_frequency) * abs(a.of[i] - b.of[i]));
    return apart <= tolerance * max(a.size, b.size);
}

} // namespace vi
