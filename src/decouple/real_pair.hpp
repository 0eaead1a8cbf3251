// Two real eigenvalues that are far apart, and the block that they make.
//
// Method      Each is found in its own time by Newton's method on (lambda^2 + D lambda + A) phi = 0, so
//             that the slow one keeps its digits, too, and
//               R + lambda S = phi                                                        (1)
//             at both. What no spring holds, A v = 0, has an eigenvalue 0, as often as there are such v:
//             R is what phi of the other one has of them, and A S = -(D + lambda) phi gives S. The
//             difference in (1) would lose it: it is of the order of lambda.                 (2)
// Accuracy    every row of (1) of pair.hpp to rounding of its terms
// Fails       nothing, where that is not so, or k or c < 0
// Reference   theory.md, "Flight"
#pragma once

#include "pair.hpp"

namespace vi {

// A real eigenvalue and its shape.
struct real_value {
    double value;
    column shape;
};

namespace detail {

// lambda^2 + D lambda + A.
inline square_matrix pencil(const damped_system& s, double value) {
    square_matrix out(s.degrees());
    for (std::size_t i = 0; i < s.degrees(); ++i) {
        for (std::size_t j = 0; j < s.degrees(); ++j)
            out(i, j) = s.stiffness(i, j) + value * s.damping(i, j);
        out(i, i) += value * value;
    }
    return out;
}

inline void newton_step(const damped_system& s, real_value& x) {
    const std::size_t n = s.degrees();
    const square_matrix a = pencil(s, x.value);
    const column by_value = sum_of(2.0 * x.value, x.shape, 1.0, s.damping * x.shape);
    const column change = solve_bordered(a, {by_value}, {x.shape}, a * x.shape);
    for (std::size_t i = 0; i < n; ++i)
        x.shape[i] -= change[i];
    x.value -= change[n];
}

inline bool is_settled(const damped_system& s, const real_value& x) {
    const square_matrix a = pencil(s, x.value);
    const double most = lost * static_cast<double>(s.degrees());
    for (std::size_t i = 0; i < s.degrees(); ++i) {
        double left = 0.0, terms = x.value * x.value * std::abs(x.shape[i]);
        for (std::size_t j = 0; j < s.degrees(); ++j) {
            left += a(i, j) * x.shape[j];
            const double dash = std::abs(x.value * s.damping(i, j));
            terms += (std::abs(s.stiffness(i, j)) + dash) * std::abs(x.shape[j]);
        }
        if (!(std::abs(left) <= most * terms)) return false;
    }
    return true;
}

} // namespace detail

// The real eigenvalue next to this one, with its shape.
inline std::optional<real_value> real_value_near(const damped_system& s, double value) {
    using namespace detail;
    const double rate = power_near(std::abs(value));
    const damped_system own = in_time_of(s, rate);
    real_value x{value / rate, elimination(pencil(own, value / rate)).null_vector(0, 1)};
    for (int i = 0; i < newton_steps; ++i)
        newton_step(own, x);
    if (!is_settled(own, x)) return {};
    x.value *= rate;
    return x;
}

// An orthonormal basis of what no spring holds.
inline std::vector<column> loose_shapes(const damped_system& s) {
    using namespace detail;
    const elimination parts(s.stiffness);
    const std::size_t dimensions = parts.null_dimensions();
    std::vector<column> out;
    for (std::size_t i = 0; i < dimensions; ++i) {
        column v = parts.null_vector(i, dimensions);
        for (int twice = 0; twice < 2; ++twice)
            for (const auto& other : out)
                v = sum_of(1.0, v, -dot(v, other), other);
        out.push_back(unit_of(v));
    }
    return out;
}

namespace detail {

// The pair if it is one in its own time.
inline std::optional<moving_pair> checked(const damped_system& s, moving_pair p, double rate) {
    if (!is_settled(in_time_of(s, rate), back_from_time_of(p, 1.0 / rate))) return {};
    return p;
}

} // namespace detail

// (2) of 0 and another eigenvalue.
inline std::optional<moving_pair> pair_with_zero(const damped_system& s,
                                                 const std::vector<column>& loose,
                                                 const std::optional<real_value>& other) {
    using namespace detail;
    if (!other) return {};
    const auto& [value, shape] = *other;
    moving_pair out{0.0, -value, column(shape.size())};
    for (const auto& v : loose)
        out.shape = sum_of(1.0, out.shape, dot(v, shape), v);
    const column force = sum_of(-value, shape, -1.0, s.damping * shape);
    const column lag = solve_bordered(s.stiffness, loose, loose, force); // not along loose ones
    const auto end = lag.begin() + static_cast<std::ptrdiff_t>(s.degrees());
    out.shape.insert(out.shape.end(), lag.begin(), end);
    return checked(s, std::move(out), power_near(std::abs(value)));
}

// (1) of two others.
inline std::optional<moving_pair> pair_of(const damped_system& s,
                                          const std::optional<real_value>& a,
                                          const std::optional<real_value>& b) {
    using namespace detail;
    if (!a || !b) return {};
    const double size = std::sqrt(dot(a->shape, a->shape) / dot(b->shape, b->shape));
    const double factor = dot(a->shape, b->shape) < 0.0 ? -size : size;
    const double apart = b->value - a->value;
    const column lag = sum_of(factor / apart, b->shape, -1.0 / apart, a->shape);
    moving_pair out{a->value * b->value, -(a->value + b->value),
                    sum_of(1.0, a->shape, -a->value, lag)};
    out.shape.insert(out.shape.end(), lag.begin(), lag.end());
    return checked(s, std::move(out), power_near(std::abs(apart)));
}

} // namespace vi
