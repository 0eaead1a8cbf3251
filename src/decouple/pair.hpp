// A pair of eigenvalues of x'' + D x' + A x = 0, and what it moves: one second-order block.
//
// Method      x = R q + S q' with q'' = -k q - c q' moves so if and only if
//               A R  + D R' - k S' = 0,   A S  + D S' + R' - c S' = 0                    (1)
//               where x' = R' q + S' q':  R' = -k S,  S' = R - c S
//             k is the product of the eigenvalues and -c their sum. (1) is linear in (R, S), and its
//             solutions have two dimensions: with q, q' solves the equation of the block. Of these
//             the one that shows least of q' is taken: S = 0 in a vibration mode.             (2)
//             Newton's method on (1), orthogonally to both dimensions, is regular also where the two
//             eigenvalues are one, where each of them alone would keep half the digits.
//             A block is found in its own time: beside stiff parts it keeps the digits of its own.
// Accuracy    every row of (1) to rounding of its terms
// Fails       nothing, where that is not so, or k or c < 0
// Reference   (1) is (T11b) of theory.md; on such pairs of polynomials: Betcke, Kressner, Linear
//             Algebra and its Applications 435 (2011) 514-536
#pragma once

#include <optional>

#include "elimination.hpp"

namespace vi {

struct damped_system {
    square_matrix stiffness, damping; // of unit masses, symmetric
    std::size_t degrees() const { return stiffness.size(); }
};

struct moving_pair {
    double k, c;
    column shape; // R, then S

    // R', then S'.
    column velocity() const {
        const std::size_t n = shape.size() / 2;
        column out(2 * n);
        for (std::size_t i = 0; i < n; ++i) {
            out[i] = -k * shape[n + i];
            out[n + i] = shape[i] - c * shape[n + i];
        }
        return out;
    }
};

namespace detail {

// Remainder of (1).
inline column left_of(const damped_system& s, const moving_pair& p) {
    const std::size_t n = s.degrees();
    const column rate = p.velocity();
    column out(2 * n);
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < n; ++j) {
            out[i] += s.stiffness(i, j) * p.shape[j] + s.damping(i, j) * rate[j];
            out[n + i] += s.stiffness(i, j) * p.shape[n + j] + s.damping(i, j) * rate[n + j];
        }
        out[i] -= p.k * rate[n + i];
        out[n + i] += rate[i] - p.c * rate[n + i];
    }
    return out;
}

// Its derivatives: by the shape, k and c.
inline square_matrix matrix_of(const damped_system& s, double k, double c) {
    const std::size_t n = s.degrees();
    square_matrix out(2 * n);
    for (std::size_t j = 0; j < 2 * n; ++j) {
        moving_pair unit{k, c, column(2 * n)};
        unit.shape[j] = 1.0;
        const column left = left_of(s, unit);
        for (std::size_t i = 0; i < 2 * n; ++i)
            out(i, j) = left[i];
    }
    return out;
}
struct changes {
    column with_k, with_c;
};
inline changes changes_of(const damped_system& s, const moving_pair& p) {
    const std::size_t n = s.degrees();
    const column rate = p.velocity();
    changes out{column(2 * n), column(2 * n)};
    for (std::size_t i = 0; i < n; ++i) {
        const double lag = p.shape[n + i];
        out.with_k[i] = -rate[n + i];
        out.with_k[n + i] = -lag;
        out.with_c[i] = p.k * lag;
        out.with_c[n + i] = p.c * lag - rate[n + i];
        for (std::size_t j = 0; j < n; ++j) {
            const double dash = s.damping(i, j) * p.shape[n + j];
            out.with_k[i] -= dash;
            out.with_c[n + i] -= dash;
        }
    }
    return out;
}

inline double dot(const column& x, const column& y) {
    double sum = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i)
        sum += x[i] * y[i];
    return sum;
}
inline column sum_of(double a, const column& x, double b, const column& y) {
    column out(x.size());
    for (std::size_t i = 0; i < x.size(); ++i)
        out[i] = a * x[i] + b * y[i];
    return out;
}

inline column unit_of(const column& x) {
    return sum_of(1.0 / std::sqrt(dot(x, x)), x, 0.0, x);
}

// The vector in the span of x and y with the smallest part of its size in the second half; of size 1.
inline column least_mixed(column x, column y) {
    const std::size_t n = x.size() / 2;
    x = unit_of(x);
    y = unit_of(sum_of(1.0, y, -dot(x, y), x));
    double xx = 0.0, xy = 0.0, yy = 0.0; // of second halves
    for (std::size_t i = n; i < 2 * n; ++i) {
        xx += x[i] * x[i];
        xy += x[i] * y[i];
        yy += y[i] * y[i];
    }
    const double half = 0.5 * (yy - xx), root = std::sqrt(half * half + xy * xy);
    // (cos, sin) of twice the angle is (half, -xy) / root
    double along = root > 0.0 ? std::sqrt(0.5 * (1.0 + std::abs(half) / root)) : 1.0;
    double across = root > 0.0 ? -0.5 * xy / (root * along) : 0.0;
    if (half < 0.0) std::swap(along, across);
    return sum_of(along, x, across, y);
}

inline void newton_step(const damped_system& s, moving_pair& p) {
    const std::size_t n = p.shape.size();
    const auto by = changes_of(s, p);
    const column change = solve_bordered(matrix_of(s, p.k, p.c), {by.with_k, by.with_c},
                                         {p.shape, p.velocity()}, left_of(s, p));
    for (std::size_t i = 0; i < n; ++i)
        p.shape[i] -= change[i];
    p.k -= change[n];
    p.c -= change[n + 1];
}

// Sizes of the terms that add up to what (1) leaves.
inline column terms_of(const damped_system& s, const moving_pair& p) {
    const std::size_t n = s.degrees();
    const column rate = p.velocity();
    column out(2 * n);
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < n; ++j) {
            const double stiffness = std::abs(s.stiffness(i, j)), dash = std::abs(s.damping(i, j));
            out[i] += stiffness * std::abs(p.shape[j]) + dash * std::abs(rate[j]);
            out[n + i] += stiffness * std::abs(p.shape[n + j]) + dash * std::abs(rate[n + j]);
        }
        out[i] += p.k * std::abs(rate[n + i]);
        out[n + i] += std::abs(rate[i]) + p.c * std::abs(rate[n + i]);
    }
    return out;
}

inline constexpr double lost = 0x1p-46; // beside one

inline bool is_settled(const damped_system& s, const moving_pair& p) {
    const column left = left_of(s, p), terms = terms_of(s, p);
    const double most = lost * static_cast<double>(s.degrees());
    for (std::size_t i = 0; i < left.size(); ++i)
        if (!(std::abs(left[i]) <= most * terms[i])) return false;
    return p.k >= 0.0 && p.c >= 0.0;
}

inline damped_system in_time_of(damped_system s, double rate) {
    for (std::size_t i = 0; i < s.degrees(); ++i)
        for (std::size_t j = 0; j < s.degrees(); ++j) {
            s.stiffness(i, j) /= rate * rate;
            s.damping(i, j) /= rate;
        }
    return s;
}
inline moving_pair back_from_time_of(moving_pair p, double rate) {
    p.k *= rate * rate;
    p.c *= rate;
    for (std::size_t i = p.shape.size() / 2; i < p.shape.size(); ++i)
        p.shape[i] /= rate;
    return p;
}

inline constexpr int newton_steps = 4;

} // namespace detail

// The pair whose eigenvalues have this product and sum, or nearly so.
inline std::optional<moving_pair> pair_of(const damped_system& s, double product, double sum) {
    using namespace detail;
    const double rate = power_near(std::sqrt(product + sum * sum));
    const damped_system own = in_time_of(s, rate);
    moving_pair p{product / (rate * rate), -sum / rate, {}};
    const elimination parts(matrix_of(own, p.k, p.c));
    p.shape = least_mixed(parts.null_vector(0, 2), parts.null_vector(1, 2));
    for (int i = 0; i < newton_steps; ++i)
        newton_step(own, p);
    if (std::abs(p.c) <= lost) p.c = 0.0; // rounding
    if (!is_settled(own, p)) return {};
    return back_from_time_of(std::move(p), rate);
}

} // namespace vi
