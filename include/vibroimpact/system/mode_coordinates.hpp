// Coordinates of a mode: positions x and velocities v of the mechanism from y, and back.
//
// Method      x = to_x y + offset,  v = to_v y                                               (1)
//             y = from_x (x - offset) + from_v v + particular w + shift                      (2)
//             with w the forcing pairs (sin theta, kappa cos theta): the last entries of y
// Assumes     row-major matrices, lent by the host
// Reference   theory.md, sections 2 and 3; src/vibroimpact/compile/coordinates.py makes the matrices
#pragma once

#include "vibroimpact/numeric/math.hpp"
#include "vibroimpact/system/hybrid.hpp"

namespace vi {

struct mode_coordinates {
    const double *to_x = nullptr, *to_v = nullptr, *offset = nullptr;         // (1)
    const double *from_x = nullptr, *from_v = nullptr, *particular = nullptr; // (2)
    const double* kappas = nullptr;
    int degrees = 0, lines = 0;
    const double* shift = nullptr; // (2); none: zero
};

// Row . y, in index order.
template <class T, int D>
VI_HD constexpr T row_times(const double* row, const vec<T, D>& y, int n) {
    T sum = row[0] * y[0];
    for (int j = 1; j < n; ++j)
        sum = sum + row[j] * y[j];
    return sum;
}

// Coordinate i of the mechanism, and its velocity: (1).
template <class T, int D>
VI_HD constexpr T position_of(const mode_coordinates& p, int i, const vec<T, D>& y, int n) {
    return row_times(p.to_x + i * n, y, n) + p.offset[i];
}
template <class T, int D>
VI_HD constexpr T velocity_of(const mode_coordinates& p, int i, const vec<T, D>& y, int n) {
    return row_times(p.to_v + i * n, y, n);
}

// Sine and cosine of a forcing line; its phase in [0, 2 pi).
template <class T, int D>
VI_HD constexpr T sine_of(const mode_coordinates& p, int line, const vec<T, D>& y, int n) {
    return y[n - 2 * p.lines + 2 * line];
}
template <class T, int D>
VI_HD constexpr T cosine_of(const mode_coordinates& p, int line, const vec<T, D>& y, int n) {
    return y[n - 2 * p.lines + 2 * line + 1] / p.kappas[line];
}
template <int D>
VI_HD inline double phase_of(const mode_coordinates& p, int line, const vec<double, D>& y, int n) {
    const double angle = atan2(sine_of(p, line, y, n), cosine_of(p, line, y, n));
    return angle < 0.0 ? angle + 2.0 * pi : angle;
}

// w of (2).
template <class T>
using forcing_pairs = vec<T, 2 * max_lines>;
template <class T>
VI_HD inline forcing_pairs<T> forcing_at(const mode_coordinates& p, const T* phases) {
    forcing_pairs<T> w{};
    for (int l = 0; l < p.lines; ++l) {
        const auto wave = sincos(phases[l]);
        w[2 * l] = wave.s;
        w[2 * l + 1] = p.kappas[l] * wave.c;
    }
    return w;
}

// (2), in the sizes of the system whose coordinates these are.
template <class T, class Shape>
VI_HD inline vec<T, Shape::max_dimension> from_physical(const mode_coordinates& p, const T* x,
                                                        const T* v, const forcing_pairs<T>& w,
                                                        const sizes<Shape>& size) {
    const int n = size.dimension(), degrees = size.oscillators(), pairs = 2 * size.lines();
    vec<T, Shape::max_dimension> y{};
    for (int i = 0; i < n; ++i) {
        T sum = T(0.0);
        for (int k = 0; k < degrees; ++k)
            sum = sum + p.from_x[i * degrees + k] * (x[k] - p.offset[k]) +
                  p.from_v[i * degrees + k] * v[k];
        for (int l = 0; l < pairs; ++l)
            sum = sum + p.particular[i * pairs + l] * w[l];
        if (p.shift) sum = sum + p.shift[i];
        y[i] = sum;
    }
    for (int l = 0; l < pairs; ++l)
        y[n - pairs + l] = w[l];
    return y;
}

// The map from one mode's y to another's through (x, v); forcing pairs pass unchanged.
template <int D>
VI_HD inline coordinate_map<D> map_between(const mode_coordinates& from, const mode_coordinates& to,
                                           int n) {
    const int degrees = to.degrees, pairs = 2 * to.lines, first_line = n - pairs;
    coordinate_map<D> out{};
    for (int i = 0; i < first_line; ++i) {
        for (int k = 0; k < degrees; ++k) {
            const double x = to.from_x[i * degrees + k], v = to.from_v[i * degrees + k];
            for (int j = 0; j < n; ++j)
                out.matrix[i][j] += x * from.to_x[k * n + j] + v * from.to_v[k * n + j];
            out.shift[i] += x * (from.offset[k] - to.offset[k]);
        }
        for (int l = 0; l < pairs; ++l)
            out.matrix[i][first_line + l] += to.particular[i * pairs + l];
        if (to.shift) out.shift[i] += to.shift[i];
    }
    for (int l = first_line; l < n; ++l)
        out.matrix[l][l] = 1.0;
    return out;
}

} // namespace vi
