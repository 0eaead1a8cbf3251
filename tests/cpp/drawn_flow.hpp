// Flows drawn at random, for programs that compare what is said of a flight with where it is.
#pragma once

#include <random>

#include "vibroimpact/system/assemble.hpp"

namespace drawn {

inline std::mt19937 numbers; // each program seeds it
inline double uniform(double low, double high) {
    return low + (high - low) * (numbers() / 4294967296.0);
}

constexpr double fastest = 1.2, step = 0.5; // at most 7/10 of the fastest rate

// A damped oscillator, a block that is free or braked, both under pushes, and a forcing line.
template <class Flow, class Push>
void draw(Flow& flow, const Push& push) {
    const double zeta = uniform(0.0, 1.5), rate = uniform(0.1, fastest), omega = fastest;
    const double brake = uniform(0.0, 1.0) < 0.5 ? 0.0 : uniform(0.0, 0.5);
    const double k[] = {rate * rate, 0.0, omega * omega}, c[] = {2.0 * zeta * rate, brake, 0.0};
    const double a[] = {push(), push(), 0.0};
    vi::set_flow(flow, {step, k, c, a, nullptr, nullptr});
}

} // namespace drawn
