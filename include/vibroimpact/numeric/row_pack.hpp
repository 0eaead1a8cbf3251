// Numbers of one trajectory side by side in registers, where pack.hpp has a trajectory in each lane.
//
// Each number undergoes the operations that it would undergo alone, in the same order: equal bits in registers of any
// size. A device has one number in each thread.
#pragma once

#include "vibroimpact/numeric/sizes.hpp"
#if !defined(__CUDACC__) && !defined(__CUDACC_RTC__)
#include "vibroimpact/numeric/pack.hpp"
#endif

namespace vi {

#if !defined(__CUDACC__) && !defined(__CUDACC_RTC__)
using row_pack = pack<native_lanes>;
using row_pair = pack<2>;

template <class Pack = row_pack>
VI_HOT Pack load(const double* from) {
    Pack out;
    __builtin_memcpy(&out, from, sizeof out);
    return out;
}
template <class Pack>
VI_HOT void store(double* to, const Pack& x) {
    __builtin_memcpy(to, &x, sizeof x);
}
#else
using row_pack = double;
using row_pair = double;

template <class Pack = row_pack>
VI_HOT Pack load(const double* from) {
    return *from;
}
VI_HOT void store(double* to, double x) {
    *to = x;
}
#endif
inline constexpr int row_lanes = scalar_traits<row_pack>::lanes;

// A length filled up to whole registers, of eight numbers in the largest.
VI_HD constexpr int filled(int n) {
    return (n + 7) / 8 * 8;
}

// to = the sum of n rows of a matrix, each times its number, and n numbers of each row. Two roundings for each product.
template <int D>
VI_HD inline void add_rows(const vec<double, D>& numbers, const vec<vec<double, D>, D>& rows, int n,
                           vec<double, D>& to) {
    const auto add = [&]<class Pack>(int j, Pack sum) {
        sum = numbers[0] * load<Pack>(rows[0].x + j);
        for (int i = 1; i < n; ++i)
            sum = sum + numbers[i] * load<Pack>(rows[i].x + j);
        store(to.x + j, sum);
    };
    int j = 0;
    for (; j + row_lanes <= n; j += row_lanes)
        add(j, row_pack(0.0));
    for (; j + 1 < n; j += scalar_traits<row_pair>::lanes)
        add(j, row_pair(0.0));
    if (j < n) add(j, 0.0);
}

// to = start + the sum of n columns, each times its number, n even, by fma: even ones and odd ones apart, as dot() does.
// Of each column so many registers.
template <int Registers>
VI_HOT void add_columns(const double* columns, int apart, const double* numbers, int n,
                        const double* start, double* to) {
    row_pack even[Registers], odd[Registers];
    unrolled<0, Registers>([&](auto r) VI_WITHIN {
        even[r] =
            fma(load(columns + r * row_lanes), row_pack(numbers[0]), load(start + r * row_lanes));
        odd[r] = load(columns + apart + r * row_lanes) * numbers[1];
    });
    for (int j = 2; j < n; j += 2) {
        const double *column = columns + j * apart, *next = column + apart;
        const row_pack x = numbers[j], z = numbers[j + 1];
        unrolled<0, Registers>([&](auto r) VI_WITHIN {
            even[r] = fma(load(column + r * row_lanes), x, even[r]);
            odd[r] = fma(load(next + r * row_lanes), z, odd[r]);
        });
    }
    unrolled<0, Registers>([&](auto r) VI_WITHIN { store(to + r * row_lanes, even[r] + odd[r]); });
}

} // namespace vi
