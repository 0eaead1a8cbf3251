// A system with any damping in independent second-order blocks.
//
// Method      Eigenvalues of x'' + D x' + A x = 0 are paired: conjugate ones, and of the real ones
//             those with signs of phi^T (2 lambda + D) phi that differ, the nearest first: only such
//             can meet and become conjugate, and there are as many of either sign, since
//             lambda^2 + D lambda + A is positive definite at both ends.                    (1)
//             Each pair is a block (pair.hpp, real_pair.hpp). The state (x, x') is a square matrix T
//             times all (q, q'), and its inverse leads back.
// Accuracy    T T^-1 = 1 to rounding times the sum of |T| |T^-1| on its diagonal
// Fails       `found` is false: no such blocks, some k or c < 0, or that sum is too large: eigenvalues
//             of several pairs that nearly meet
// Reference   theory.md, "Flight"; Ma, Imam, Morzfeld, Journal of Sound and Vibration 324 (2009)
//             408-428; Gohberg, Lancaster, Rodman, Matrix Polynomials (1982), chapter 10
#pragma once

#include "eigenvalues.hpp"
#include "real_pair.hpp"

namespace vi {

struct decoupled {
    bool found = false;
    std::vector<moving_pair> blocks;
    std::vector<column> back; // rows of T^-1: q and q' of every block from (x, x')
};

inline constexpr double most_cancelled = 256.0; // of |T| |T^-1|: eight bits

namespace detail {

inline square_matrix companion(const damped_system& s) {
    const std::size_t n = s.degrees();
    square_matrix b(2 * n);
    for (std::size_t i = 0; i < n; ++i) {
        b(i, n + i) = 1.0;
        for (std::size_t j = 0; j < n; ++j) {
            b(n + i, j) = -s.stiffness(i, j);
            b(n + i, n + j) = -s.damping(i, j);
        }
    }
    return b;
}

// Whether the sign of a real eigenvalue is +. That of 0 always is, where damping is not negative.
inline bool is_positive(const damped_system& s, double value) {
    if (value == 0.0) return true;
    const column phi = elimination(pencil(s, value)).null_vector(0, 1);
    return 2.0 * value * dot(phi, phi) + dot(phi, s.damping * phi) > 0.0;
}

// Two eigenvalues: their real parts, and the imaginary one of the first.
struct two_values {
    double first, second, imaginary = 0.0;
};

// Of two real eigenvalues, as a part of the larger one. Where it is far, one is a thousandth of it.
inline constexpr double far = 1.0 - 0x1p-10;
inline double distance(double a, double b) {
    return std::abs(a - b) / std::max(std::abs(a), std::abs(b));
}

// Take the nearest two from lists of + and -.
inline two_values take_nearest(column& positive, column& negative) {
    std::size_t first = 0, second = 0;
    for (std::size_t i = 0; i < positive.size(); ++i)
        for (std::size_t j = 0; j < negative.size(); ++j)
            if (distance(positive[i], negative[j]) < distance(positive[first], negative[second])) {
                first = i;
                second = j;
            }
    const two_values out{positive[first], negative[second]};
    positive.erase(positive.begin() + static_cast<std::ptrdiff_t>(first));
    negative.erase(negative.begin() + static_cast<std::ptrdiff_t>(second));
    return out;
}

// (1), the smallest so many being zero; fewer than there are where that fails.
inline std::vector<two_values> paired(const damped_system& s,
                                      std::vector<std::complex<double>> values, std::size_t zeros) {
    const auto size = [](const auto& x) { return x.real() * x.real() + x.imag() * x.imag(); };
    std::stable_sort(values.begin(), values.end(), // no library rounds differently
                     [&](const auto& a, const auto& b) { return size(a) < size(b); });
    std::fill_n(values.begin(), std::min(zeros, values.size()), 0.0);
    std::vector<two_values> out;
    column positive, negative;
    for (const auto& x : values) {
        if (x.imag() == 0.0)
            (is_positive(s, x.real()) ? positive : negative).push_back(x.real());
        else if (x.imag() > 0.0)
            out.push_back({x.real(), x.real(), x.imag()});
    }
    while (!positive.empty() && !negative.empty())
        out.push_back(take_nearest(positive, negative));
    return out;
}

// T, a pair of columns per block.
inline square_matrix states_of(const std::vector<moving_pair>& blocks) {
    const std::size_t n = blocks.size();
    square_matrix t(2 * n);
    for (std::size_t j = 0; j < n; ++j) {
        const column rate = blocks[j].velocity();
        for (std::size_t i = 0; i < n; ++i) {
            t(i, 2 * j) = blocks[j].shape[i];
            t(i, 2 * j + 1) = blocks[j].shape[n + i];
            t(n + i, 2 * j) = rate[i];
            t(n + i, 2 * j + 1) = rate[n + i];
        }
    }
    return t;
}

inline double cancelled(const square_matrix& t, const std::vector<column>& back) {
    double most = 0.0;
    for (std::size_t i = 0; i < t.size(); ++i) {
        double sum = 0.0;
        for (std::size_t j = 0; j < t.size(); ++j)
            sum += std::abs(t(i, j) * back[j][i]);
        most = sum > most ? sum : most;
    }
    return most;
}

// A power of two near the fastest rate.
inline double fastest_rate(const damped_system& s) {
    double stiff = 0.0, damped = 0.0;
    for (std::size_t i = 0; i < s.degrees(); ++i)
        for (std::size_t j = 0; j < s.degrees(); ++j) {
            stiff = std::max(stiff, std::abs(s.stiffness(i, j)));
            damped = std::max(damped, std::abs(s.damping(i, j)));
        }
    return power_near(std::max(std::sqrt(stiff), damped));
}

// A block for every two eigenvalues; fewer than there are where that fails. Rates of the order of one.
inline std::vector<moving_pair> blocks_of(const damped_system& s) {
    std::vector<moving_pair> out;
    const auto loose = loose_shapes(s);
    const auto pairs = paired(s, eigenvalues(companion(s)), loose.size());
    const auto at = [&](double value) { return real_value_near(s, value); };
    for (const auto& [first, second, imaginary] : pairs) {
        const bool close = imaginary != 0.0 || distance(first, second) < far;
        const auto block = close
                               ? pair_of(s, first * second + imaginary * imaginary, first + second)
                           : first == 0.0 ? pair_with_zero(s, loose, at(second))
                                          : pair_of(s, at(first), at(second));
        if (block) out.push_back(*block);
    }
    return out;
}

inline std::vector<column> rows_of_inverse(const square_matrix& t) {
    const elimination parts(t);
    std::vector<column> out(t.size(), column(t.size()));
    for (std::size_t i = 0; i < t.size(); ++i) {
        column unit(t.size());
        unit[i] = 1.0;
        const column x = parts.solve(unit);
        for (std::size_t j = 0; j < t.size(); ++j)
            out[j][i] = x[j];
    }
    return out;
}

} // namespace detail

// All in the time of the fastest rate: pivots are the same in any unit of time.
inline decoupled decouple(const damped_system& s) {
    using namespace detail;
    const double rate = fastest_rate(s);
    const std::size_t n = s.degrees();
    decoupled out;
    out.blocks = blocks_of(in_time_of(s, rate));
    if (out.blocks.size() != n) return {};
    const square_matrix t = states_of(out.blocks);
    out.back = rows_of_inverse(t);
    out.found = cancelled(t, out.back) <= most_cancelled; // false of NaN
    for (std::size_t j = 0; j < n; ++j) {
        out.blocks[j] = back_from_time_of(std::move(out.blocks[j]), rate);
        for (std::size_t i = 0; i < n; ++i) {
            out.back[2 * j][n + i] /= rate;
            out.back[2 * j + 1][i] *= rate;
        }
    }
    return out;
}

} // namespace vi
