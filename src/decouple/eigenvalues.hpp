// Eigenvalues of a real matrix.
//
// Method      Householder's reduction to Hessenberg form, then Francis' steps with two shifts; a
//             subdiagonal entry that is lost beside its neighbours splits the matrix.
// Accuracy    backward stable
// Fails       an empty answer: no convergence (never observed)
// Reference   Golub, Van Loan, Matrix Computations (2013), sections 7.4.2 and 7.5
#pragma once

#include <complex>

#include "elimination.hpp"

namespace vi {

namespace detail {

using eigenvalue = std::complex<double>;

// 1 - beta v v^T turns x into a multiple of the first unit vector.
struct reflection {
    column v;
    double beta = 0.0;

    explicit reflection(column x) : v(std::move(x)) {
        double rest = 0.0;
        for (std::size_t i = 1; i < v.size(); ++i)
            rest += v[i] * v[i];
        if (rest == 0.0) return;
        const double size = std::sqrt(v[0] * v[0] + rest);
        v[0] = v[0] > 0.0 ? v[0] + size : v[0] - size;
        beta = 2.0 / (v[0] * v[0] + rest);
    }
    // From the left in some columns, from the right in some rows; it acts on entries from `at` on.
    void turn_rows(square_matrix& a, std::size_t at, std::size_t from, std::size_t to) const {
        for (std::size_t j = from; j < to; ++j) {
            double sum = 0.0;
            for (std::size_t i = 0; i < v.size(); ++i)
                sum += v[i] * a(at + i, j);
            for (std::size_t i = 0; i < v.size(); ++i)
                a(at + i, j) -= beta * sum * v[i];
        }
    }
    void turn_columns(square_matrix& a, std::size_t at, std::size_t from, std::size_t to) const {
        for (std::size_t i = from; i < to; ++i) {
            double sum = 0.0;
            for (std::size_t j = 0; j < v.size(); ++j)
                sum += v[j] * a(i, at + j);
            for (std::size_t j = 0; j < v.size(); ++j)
                a(i, at + j) -= beta * sum * v[j];
        }
    }
};

inline void to_hessenberg(square_matrix& a) {
    const std::size_t n = a.size();
    for (std::size_t k = 0; k + 2 < n; ++k) {
        column below;
        for (std::size_t i = k + 1; i < n; ++i)
            below.push_back(a(i, k));
        const reflection turn(below);
        turn.turn_rows(a, k + 1, k, n);
        turn.turn_columns(a, k + 1, 0, n);
        for (std::size_t i = k + 2; i < n; ++i)
            a(i, k) = 0.0;
    }
}

// Sum and product of two eigenvalues.
struct shifts {
    double sum, product;
};

// One step on rows and columns first, ..., last, at least three of them.
inline void francis_step(square_matrix& h, std::size_t first, std::size_t last, const shifts& by) {
    const std::size_t f = first, end = last + 1;
    column x = {h(f, f) * h(f, f) + h(f, f + 1) * h(f + 1, f) - by.sum * h(f, f) + by.product,
                h(f + 1, f) * (h(f, f) + h(f + 1, f + 1) - by.sum), h(f + 1, f) * h(f + 2, f + 1)};
    for (std::size_t k = first; k < last; ++k) {
        const reflection turn(x);
        const std::size_t rows = x.size();
        turn.turn_rows(h, k, k > first ? k - 1 : first, end);
        turn.turn_columns(h, k, first, std::min(k + rows + 1, end));
        x.clear();
        for (std::size_t i = k + 1; i < std::min(k + 4, end); ++i)
            x.push_back(h(i, k));
    }
    for (std::size_t i = first + 2; i < end; ++i) // what rounding has left below
        for (std::size_t j = first; j + 1 < i; ++j)
            h(i, j) = 0.0;
}

// The two of the block whose last row is `last`.
inline void add_two(const square_matrix& h, std::size_t last, std::vector<eigenvalue>& to) {
    const double a = h(last - 1, last - 1), d = h(last, last);
    const double half = 0.5 * (a - d), across = h(last - 1, last) * h(last, last - 1);
    const double q = half * half + across;
    const double root = std::sqrt(std::abs(q));
    if (q < 0.0) {
        to.emplace_back(d + half, root);
        to.emplace_back(d + half, -root);
        return;
    }
    const double far = half + (half >= 0.0 ? root : -root);
    to.emplace_back(d + far);
    to.emplace_back(far == 0.0 ? d : d - across / far);
}

} // namespace detail

inline std::vector<std::complex<double>> eigenvalues(square_matrix h) {
    using namespace detail;
    constexpr int most_steps = 60; // for one eigenvalue, or two
    std::vector<eigenvalue> out;
    to_hessenberg(h);
    std::size_t end = h.size();
    for (int steps = 0; end > 0; ++steps) {
        std::size_t first = end - 1;
        for (; first > 0; --first) {
            const double beside = std::abs(h(first, first)) + std::abs(h(first - 1, first - 1));
            if (std::abs(h(first, first - 1)) <= 0x1p-53 * beside) break;
        }
        const std::size_t last = end - 1;
        if (first == last) {
            out.emplace_back(h(last, last));
            end -= 1;
        } else if (first + 1 == last) {
            add_two(h, last, out);
            end -= 2;
        } else {
            if (steps == most_steps) return {};
            shifts by = {h(last - 1, last - 1) + h(last, last),
                         h(last - 1, last - 1) * h(last, last) -
                             h(last - 1, last) * h(last, last - 1)};
            if (steps % 10 == 9) { // no progress: some other shifts
                const double size = std::abs(h(last, last - 1)) + std::abs(h(last - 1, last - 2));
                by = {1.5 * size, size * size};
            }
            francis_step(h, first, last, by);
            continue;
        }
        steps = -1;
    }
    return out;
}

} // namespace vi
