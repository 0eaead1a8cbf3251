// Powers of numbers, as Python's ** has them: of jets and, with the same value, of doubles.
#pragma once

#include <cmath>

#include "vibroimpact/numeric/mixed_jet.hpp"

namespace binding {

template <class T>
T whole_power(const T& x, int n) {
    if (n < 0) return 1.0 / whole_power(x, -n);
    T result(1.0);
    for (int i = 0; i < n; ++i)
        result = result * x;
    return result;
}

template <class T>
T power(const T& x, double a) {
    if (a == std::floor(a) && std::abs(a) <= 64.0) return whole_power(x, static_cast<int>(a));
    if (a == 0.5) return vi::sqrt(x);
    return vi::exp(a * vi::log(x));
}

} // namespace binding
