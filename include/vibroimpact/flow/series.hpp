// Flights shorter than a step, without elementary functions.
//
// Method      S and I of block.hpp are polynomials of stored coefficients, S = S_1 s + S_2 s^2 + ...,
//               (n+1) n S_{n+1} = -c n S_n - k S_{n-1},   I_{n+1} = S_n / (n+1)           (1)
//             s in a unit of time of their own, k and c likewise.
//             Even and odd powers are summed apart, which halves the time until the result is there.
//             Forcing lines take cos and sin by their own series.
// Accuracy    18 terms leave (7/10)^19/19! of the amplitude after a step, below 2^-60
// Reference   theory.md, "Flight"
#pragma once

#include "vibroimpact/flow/table.hpp"

namespace vi {

// Terms of Taylor expansions over one step; a step is at most 7/10 of the fastest rate.
inline constexpr int taylor_order = 18;

// Part of a step: so far beyond its end series still hold, as their remainder, (7/10)^19/19!, grows by 19 times this.
inline constexpr double beyond_step = 0x1p-12;

// The unit of time of Taylor polynomials, a power of two next to the step: their derivatives are as large as the
// motion then, whatever the rates of the machine are, and stay within the range of doubles.
VI_HD constexpr double unit_of_time(double step) {
    return power_of_two_below(step);
}

VI_HD constexpr double inverse_factorial(int n) {
    double product = 1.0;
    for (int i = 2; i <= n; ++i)
        product = product * i;
    return 1.0 / product;
}

template <class R>
struct block_series {
    R terms[taylor_order / 2][4]; // row m: of S / s and I / s^2 before s^(2 m), then s^(2 m + 1)

    VI_HD void expand(double k, double c) { // (1)
        double before = 0.0, coefficient = 1.0;
        for (int n = 1; n <= taylor_order; ++n) {
            R* to = terms[(n - 1) / 2] + (n % 2 ? 0 : 2);
            to[0] = coefficient;
            to[1] = coefficient / (n + 1.0);
            const double next = -(c * n * coefficient + k * before) / (n * (n + 1.0));
            before = coefficient;
            coefficient = next;
        }
    }

    // S / s and I / s^2, by the first terms, an even number of them.
    template <int Order, class Time>
    VI_HOT constexpr two<Time> sums(const Time& s, const Time& square) const {
        return {sum<Order, 0>(s, square), sum<Order, 1>(s, square)};
    }

private:
    template <int Order, int Which, class Time>
    VI_HOT constexpr Time sum(const Time& s, const Time& square) const {
        constexpr int rows = (Order + 1) / 2;
        Time even = Time(terms[rows - 1][Which]), odd = Time(terms[rows - 1][Which + 2]);
        unrolled<0, rows - 1>([&](auto term) VI_WITHIN {
            constexpr int m = rows - 2 - term;
            even = fma(even, square, terms[m][Which]);
            odd = fma(odd, square, terms[m][Which + 2]);
        });
        return fma(odd, s, even);
    }
};

// cos z and sin z / z, x = z^2: as many terms.
template <int Order, class R, class Time>
VI_HOT constexpr two<Time> waves(const Time& x) {
    constexpr int rows = (Order + 1) / 2;
    two<Time> sum{Time(inverse_factorial(2 * rows)), Time(inverse_factorial(2 * rows - 1))};
    unrolled<0, rows>(
        [&](auto m) { sum.first = fnma(sum.first, x, R(inverse_factorial(2 * (rows - 1 - m)))); });
    unrolled<0, rows - 1>([&](auto m) {
        sum.second = fnma(sum.second, x, R(inverse_factorial(2 * (rows - 2 - m) + 1)));
    });
    return sum;
}

} // namespace vi
