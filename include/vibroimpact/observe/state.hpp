// Two states compared, relative to their size.
//
// Method      size = the largest of |x_i| and |v_i| / w of both states, w a frequency     (1)
//             they agree if positions differ by at most tolerance * size, velocities by
//             tolerance * w * size, sine and cosine of each forcing line by tolerance     (2)
#pragma once

#include "vibroimpact/observe/scene.hpp"

namespace vi {

// Rows that lead from the free coordinates to (x, v), lent by the host; row-major, degrees rows.
struct physical_rows {
    const double *to_x = nullptr, *to_v = nullptr, *offset = nullptr;
    const double* kappas = nullptr; // the forcing pairs are (sin, kappa cos)
    double frequency = 1.0;         // w of (1)
    int degrees = 0;
};

// x, v, then the forcing pairs (sin, cos).
template <int D>
struct physical_state {
    vec<double, D> of;
};

template <class Flow>
VI_HD inline physical_state<Flow::max_dimension> physical(const physical_rows& rows,
                                                          const scene<Flow>& s) {
    const int n = s.system.dimension(), degrees = rows.degrees;
    const auto y = s.at.mode > 0 ? s.system.to_free[s.at.mode](s.at.y, n) : s.at.y;
    const auto times = [&](const double* row) {
        double sum = row[0] * y[0];
        for (int j = 1; j < n; ++j)
            sum = sum + row[j] * y[j];
        return sum;
    };
    physical_state<Flow::max_dimension> out{};
    const double *to_x = rows.to_x, *to_v = rows.to_v;
    for (int i = 0; i < degrees; ++i, to_x += n, to_v += n) {
        out.of[i] = times(to_x) + rows.offset[i];
        out.of[degrees + i] = times(to_v);
    }
    for (int l = 0; l < s.system.lines(); ++l) {
        const int at = n - 2 * s.system.lines() + 2 * l;
        out.of[2 * degrees + 2 * l] = y[at];
        out.of[2 * degrees + 2 * l + 1] = y[at + 1] / rows.kappas[l];
    }
    return out;
}

// (2)
template <int D>
VI_HD inline bool same_state(const physical_state<D>& a, const physical_state<D>& b,
                             const physical_rows& rows, int lines, double tolerance) {
    const int n = rows.degrees;
    for (int i = 2 * n; i < 2 * (n + lines); ++i)
        if (!(abs(a.of[i] - b.of[i]) <= tolerance)) return false;
    double size = 0.0, apart = 0.0;
    for (int i = 0; i < 2 * n; ++i) {
        const double unit = i < n ? 1.0 : 1.0 / rows.frequency;
        size = max(size, unit * max(abs(a.of[i]), abs(b.of[i]))); // (1)
        apart = max(apart, unit * abs(a.of[i] - b.of[i]));
    }
    return apart <= tolerance * size;
}

} // namespace vi
