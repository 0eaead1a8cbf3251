// Flow of any linear mechanism: y' = B y + b with a full matrix B.
//
// Method      exp(B s) - 1 by its Taylor series for |B| s <= 7/10, longer times by squaring:
//             exp(B step 2^n), n = 0, ..., 10, are stored, and a flight of any length applies those
//             named by the binary digits of t / step, squared anew beyond, then one Taylor flight. What is kept
//             is D = exp(B t) - 1, y -> y + D y, squared as 2 D + D^2: a step that is short for a slow mode
//             moves it by little, which would be lost beside 1, 2^n times over after n squares. No eigenvector
//             is formed, so repeated and defective eigenvalues, free masses and exact resonance
//             are ordinary points, and no library decides the bits. R may be a jet: B, b and the
//             time then carry derivatives, and at_time gives those of exp(B t), which no
//             decomposition of B has at repeated frequencies.
// Assumes     finite B, b; |B| in the maximum row sum.
// Accuracy    relative to |exp(B t)| |y|: about (number of digits + 18) ulp, that of (B, t)
//             perturbed by a few ulp, in each mode by what it moves
// Reference   theory.md, "Flight"; Higham, Functions of Matrices (2008), ch. 10 (scaling and squaring)
#pragma once

#include "vibroimpact/flow/modal.hpp"
#include "vibroimpact/numeric/row_pack.hpp"

namespace vi {

// The field B y + b and its exponentials.
template <class R, class Shape>
struct linear_field : sizes<Shape> {
    static constexpr int max_dimension = Shape::max_dimension;
    template <class T>
    using state = vec<T, max_dimension>;
    using matrix = vec<vec<R, max_dimension>, max_dimension>;

    struct propagator {
        matrix change; // exp(B t) - 1
        vec<R, max_dimension> shift;

        VI_HD constexpr R entry(int i, int j) const { // of exp(B t)
            return i == j ? R(1.0) + change[i][j] : change[i][j];
        }
    };

    matrix b;
    vec<R, max_dimension> constant;
    double step; // |B| step <= 7/10

    template <class T>
    VI_HD constexpr state<T> apply(const propagator& p, const state<T>& y) const {
        const int n = this->dimension();
        state<T> out = y;
        for (int i = 0; i < n; ++i)
            out[i] = y[i] + (dot(p.change[i], y, n) + p.shift[i]);
        return out;
    }

    template <class T>
    VI_HD constexpr state<T> derivative(const state<T>& y) const {
        const int n = this->dimension();
        state<T> out = y;
        for (int i = 0; i < n; ++i)
            out[i] = dot(b[i], y, n) + constant[i];
        return out;
    }

    // dy + s/2 B dy + s^2/6 B^2 dy + ... by Horner's rule: s times it is what y changes by.
    template <int Order, class T, class Time>
    VI_HD constexpr state<T> mean_rate(const state<T>& dy, const Time& s) const {
        const int n = this->dimension();
        state<T> sum = dy, next = dy;
        for (int m = Order; m >= 2; --m) { // whole states are large to copy
            for (int i = 0; i < n; ++i)
                next[i] = dy[i] + dot(b[i], sum, n) * (s * (1.0 / m));
            for (int i = 0; i < n; ++i)
                sum[i] = next[i];
        }
        return sum;
    }

    template <int Order, class T, class Time>
    VI_HD constexpr state<T> short_flight(const state<T>& y, const Time& s) const {
        const state<T> sum = mean_rate<Order>(derivative(y), s);
        state<T> out = y;
        for (int i = 0; i < this->dimension(); ++i)
            out[i] = y[i] + sum[i] * s;
        return out;
    }

    // exp(B t), t >= 0, by halving t until it is below a step, and squaring.
    VI_HD propagator at_time(const R& t) const {
        R part = t;
        int halvings = 0;
        for (; plain(part) > step; ++halvings)
            part = part * 0.5;
        propagator p = taylor_propagator(part);
        for (; halvings > 0; --halvings)
            p = after(p, p);
        return p;
    }

    // The shift is the flight of zero, s <= step; columns of exp(B s) are flights of unit vectors
    // without b, not differences of two flights with it: where b is large, these are its rounding.
    VI_HD propagator taylor_propagator(const R& s) const {
        const int n = this->dimension();
        propagator p{};
        p.shift = short_flight<taylor_order>(state<R>{}, s);
        for (int j = 0; j < n; ++j) {
            state<R> column{};
            for (int i = 0; i < n; ++i)
                column[i] = b[i][j];
            const state<R> sum = mean_rate<taylor_order>(column, s);
            for (int i = 0; i < n; ++i)
                p.change[i][j] = sum[i] * s;
        }
        return p;
    }

    VI_HD propagator after(const propagator& second, const propagator& first) const {
        const int n = this->dimension();
        propagator p{};
        p.shift = apply(second, first.shift);
        for (int i = 0; i < n; ++i) {
            const state<R> sum = times(second.change[i], first.change);
            for (int j = 0; j < n; ++j)
                p.change[i][j] = (second.change[i][j] + first.change[i][j]) + sum[j];
        }
        return p;
    }

    // A row times a matrix.
    VI_HD constexpr state<R> times(const vec<R, max_dimension>& row, const matrix& by) const {
        const int n = this->dimension();
        state<R> out = row;
        if constexpr (is_same<R, double>) {
            add_rows(row, by, n, out);
        } else {
            for (int j = 0; j < n; ++j) {
                R sum = row[0] * by[0][j];
                for (int i = 1; i < n; ++i)
                    sum = sum + row[i] * by[i][j];
                out[j] = sum;
            }
        }
        return out;
    }
};

template <class R, class Shape>
struct dense_flow : linear_field<R, Shape> {
    using field = linear_field<R, Shape>;
    using shape_type = Shape;
    using field::b, field::constant, field::step;
    using typename field::propagator;
    static constexpr int max_dimension = Shape::max_dimension;
    static constexpr int max_contacts = Shape::max_contacts;
    static constexpr int doublings = 40, stored_doublings = 11; // flights up to 2^40 steps
    template <class T>
    using state = vec<T, max_dimension>;

    propagator once, leap, refresh[2];
    typename field::matrix
        norm; // |N z| of the mechanical part z of y grows by exp(growth t) at most (system/stride.hpp)
    R growth;
    propagator doubled[stored_doublings];

    template <class T>
    VI_HD state<T> flight(const state<T>& y, double t) const {
        state<T> out = y;
        double left = t;
        for (int m = doublings - 1; m >= 0; --m) {
            double length = step;
            for (int i = 0; i < m; ++i)
                length = length + length;
            if (!(left >= length)) continue;
            const propagator p = power(m);
            while (left >= length) {
                out = this->apply(p, out);
                left = left - length;
            }
        }
        return this->template short_flight<taylor_order>(out, left);
    }

    // exp(B step 2^m).
    VI_HD propagator power(int m) const {
        propagator p = doubled[m < stored_doublings ? m : stored_doublings - 1];
        for (int i = stored_doublings; i <= m; ++i)
            p = this->after(p, p);
        return p;
    }

    VI_HD void prepare() {
        doubled[0] = this->taylor_propagator(step);
        for (int m = 1; m < stored_doublings; ++m)
            doubled[m] = this->after(doubled[m - 1], doubled[m - 1]);
        once = doubled[0];
        leap = this->after(doubled[1], doubled[0]);
        refresh[0] = doubled[5];
        refresh[1] = doubled[10];
    }

    VI_HD constexpr vec<R, max_dimension> next_row(const vec<R, max_dimension>& r) const {
        return this->times(r, b);
    }
    VI_HD constexpr R row_gain(const vec<R, max_dimension>& r) const {
        return dot(r, constant, this->dimension());
    }
};

} // namespace vi
