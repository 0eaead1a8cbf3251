// A system with any damping in independent second-order blocks.
//
// Method      Eigenvalues of x'' + D x' + A x = 0 are paired: conjugate ones, and of the real ones one
//             whose sign phi^T (2 lambda + D) phi is + with the nearest free one below it whose sign is
//             -. From above, every - follows a + of its own, since lambda^2 + D lambda + A is positive
//             definite at both ends; only a + and a - can meet and become conjugate, so what is
//             close to that is paired.                                                     (1)
//             Each pair is a block (pair.hpp). What no spring holds has eigenvalue 0, as often as it
//             has dimensions: there R is one of them, and R + lambda S the shape of the other one.
//             The state (x, x') is a square matrix T times all (q, q'), and its inverse leads back.
// Accuracy    T T^-1 = 1 to rounding times the sum of |T| |T^-1| on its diagonal
// Fails       `found` is false: no such blocks, some k or c < 0, or that sum is too large: eigenvalues
//             of several pairs that nearly meet
// Reference   theory.md, "Flight"; Ma, Imam, Morzfeld, Journal of Sound and Vibration 324 (2009)
//             408-428; Gohberg, Lancaster, Rodman, Matrix Polynomials (1982), chapter 10
#pragma once

#include "eigenvalues.hpp"
#include "pair.hpp"

namespace vi {

struct decoupled {
    bool found = false;
    std::vector<moving_pair> blocks;
    std::vector<column> back; // rows of T^-1: q and q' of every block from (x, x')
};

inline constexpr double most_cancelled = 256.0; // of |T| |T^-1|: eight bits

namespace detail {

inline constexpr double lost_beside_one = 0x1p-46;
inline constexpr double zero_beside_one = 0x1p-42; // of eigenvalues

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

// Vector i of a basis of the shapes that have a real eigenvalue.
inline column shape_at(const damped_system& s, double value, std::size_t i,
                       std::size_t dimensions) {
    const std::size_t n = s.degrees();
    square_matrix q(n);
    for (std::size_t row = 0; row < n; ++row) {
        for (std::size_t j = 0; j < n; ++j)
            q(row, j) = s.stiffness(row, j) + value * s.damping(row, j);
        q(row, row) += value * value;
    }
    return elimination(q).null_vector(i, dimensions);
}

// Whether the sign of a real eigenvalue is +. That of 0 always is, where damping is not negative.
inline bool is_positive(const damped_system& s, double value) {
    if (value == 0.0) return true;
    const column phi = shape_at(s, value, 0, 1);
    return 2.0 * value * dot(phi, phi) + dot(phi, s.damping * phi) > 0.0;
}

// The pair of 0, whose shape is given, and another eigenvalue.
inline moving_pair dragged_pair(const damped_system& s, const column& loose, double value) {
    const column shape = shape_at(s, value, 0, 1);
    const double size = std::sqrt(dot(loose, loose) / dot(shape, shape));
    const column lag =
        sum_of((dot(loose, shape) < 0.0 ? -size : size) / value, shape, -1.0 / value, loose);
    moving_pair p{0.0, -value, loose};
    p.shape.insert(p.shape.end(), lag.begin(), lag.end());
    return p;
}

struct two_values {
    double product, sum;
};

// (1); fewer than there are where that fails.
inline std::vector<two_values> paired(const damped_system& s,
                                      const std::vector<std::complex<double>>& values) {
    std::vector<two_values> out;
    column real, open;
    for (const auto& x : values) {
        if (std::abs(x) <= zero_beside_one)
            real.push_back(0.0);
        else if (x.imag() == 0.0)
            real.push_back(x.real());
        else if (x.imag() > 0.0)
            out.push_back({std::norm(x), 2.0 * x.real()});
    }
    std::sort(real.rbegin(), real.rend());
    for (const double x : real) {
        if (is_positive(s, x)) {
            open.push_back(x);
        } else if (!open.empty()) {
            out.push_back({open.back() * x, open.back() + x});
            open.pop_back();
        }
    }
    return out;
}

// Whether (1) of pair.hpp holds to rounding; k and c that are lost in it become zero.
inline bool settle(const damped_system& s, moving_pair& p) {
    if (std::abs(p.k) <= lost_beside_one) p.k = 0.0;
    if (std::abs(p.c) <= lost_beside_one) p.c = 0.0;
    const column left = left_of(s, p);
    const double size = dot(p.shape, p.shape);
    const double most = lost_beside_one * static_cast<double>(s.degrees());
    return p.k >= 0.0 && p.c >= 0.0 && dot(left, left) <= most * most * size;
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
inline double rate_of(const damped_system& s) {
    double stiff = 0.0, damped = 0.0;
    for (std::size_t i = 0; i < s.degrees(); ++i)
        for (std::size_t j = 0; j < s.degrees(); ++j) {
            stiff = std::max(stiff, std::abs(s.stiffness(i, j)));
            damped = std::max(damped, std::abs(s.damping(i, j)));
        }
    int exponent = 0;
    std::frexp(std::max(std::sqrt(stiff), damped), &exponent);
    return std::ldexp(1.0, exponent);
}

inline damped_system in_time_of(damped_system s, double rate) {
    for (std::size_t i = 0; i < s.degrees(); ++i)
        for (std::size_t j = 0; j < s.degrees(); ++j) {
            s.stiffness(i, j) /= rate * rate;
            s.damping(i, j) /= rate;
        }
    return s;
}

inline decoupled back_in_time_of(decoupled d, double rate) {
    const std::size_t n = d.blocks.size();
    for (std::size_t i = 0; i < n; ++i) {
        auto& p = d.blocks[i];
        p.k *= rate * rate;
        p.c *= rate;
        for (std::size_t j = 0; j < n; ++j) {
            p.shape[n + j] /= rate;
            d.back[2 * i][n + j] /= rate;
            d.back[2 * i + 1][j] *= rate;
        }
    }
    return d;
}

// A block for every two eigenvalues; fewer than there are where that fails.
inline std::vector<moving_pair> blocks_of(const damped_system& s) {
    std::vector<moving_pair> out;
    const auto pairs = paired(s, eigenvalues(companion(s)));
    const auto is_loose = [](const two_values& p) { return p.product == 0.0; };
    const auto loose =
        static_cast<std::size_t>(std::count_if(pairs.begin(), pairs.end(), is_loose));
    std::size_t met = 0; // of these
    for (const auto& p : pairs) {
        auto block = is_loose(p) ? dragged_pair(s, shape_at(s, 0.0, met++, loose), p.sum)
                                 : pair_of(s, p.product, p.sum);
        if (settle(s, block)) out.push_back(std::move(block));
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

inline decoupled decouple(const damped_system& s) {
    using namespace detail;
    const double rate = rate_of(s);
    decoupled out;
    out.blocks = blocks_of(in_time_of(s, rate));
    if (out.blocks.size() != s.degrees()) return {};
    const square_matrix t = states_of(out.blocks);
    out.back = rows_of_inverse(t);
    out.found = cancelled(t, out.back) <= most_cancelled; // false of NaN
    return back_in_time_of(std::move(out), rate);
}

} // namespace vi
