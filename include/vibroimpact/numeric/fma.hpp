// a b + c with one rounding, the same bits with and without the instruction for it.
//
// Method      The instruction where the target has it. Elsewhere a b and the sums with c are taken without
//             error as two doubles each, and the two small ones are added with rounding to odd, so that
//             the last sum rounds as if it were the only one (Boldo, Melquiond, algorithm Fma). Where a
//             part could overflow or underflow, in whole numbers: significands as 53-bit integers,
//             their product and the addend aligned in 128 bits, bits shifted out kept as one sticky
//             bit, one rounding to nearest, ties to even.
// Assumes     for WebAssembly with relaxed SIMD, whose instruction may round twice, that the caller has
//             tried it: `fused` of web/kernel/page.cpp
// Accuracy    correctly rounded for all numbers, subnormal results included; NaN and infinities as
//             the plain operations give them
// Reference   IEEE 754-2019, fusedMultiplyAdd
//             S. Boldo, G. Melquiond: Emulation of a FMA and correctly rounded sums: proved algorithms
//             using rounding to odd. IEEE Trans. Computers 57 (2008) 462-471
#pragma once

#include "vibroimpact/numeric/config.hpp"

namespace vi {

#if !defined(__CUDACC__) && !defined(__CUDACC_RTC__)

namespace detail {

__extension__ typedef unsigned __int128 wide;

// (-1)^negative m 2^e, m < 2^53.
struct unpacked {
    bool negative;
    unsigned long long m;
    int e;
};
VI_HD constexpr unpacked unpack(double x) {
    const auto b = __builtin_bit_cast(unsigned long long, x);
    const int exponent = static_cast<int>(b >> 52 & 0x7ff);
    const unsigned long long fraction = b & 0xfffffffffffffull;
    return {(b >> 63) != 0, exponent ? fraction | 1ull << 52 : fraction,
            (exponent ? exponent : 1) - 1075};
}

VI_HD constexpr unsigned long long high_half(wide m) {
    return static_cast<unsigned long long>(m >> 64);
}
VI_HD constexpr wide join(unsigned long long high, unsigned long long low) {
    return wide(high) << 64 | low;
}

// Operations for which compilers call a library on 32-bit targets, in parts: a b for a, b < 2^54, and shifts.
VI_HD constexpr wide product_of(unsigned long long a, unsigned long long b) {
    constexpr unsigned long long low = (1ull << 27) - 1;
    const unsigned long long middle = (a >> 27) * (b & low) + (a & low) * (b >> 27);
    return (wide((a >> 27) * (b >> 27)) << 54) + (wide(middle) << 27) + wide((a & low) * (b & low));
}
VI_HD constexpr wide shift_left(wide m, int n) { // 0 <= n < 128
    const auto high = high_half(m), low = static_cast<unsigned long long>(m);
    if (n == 0) return m;
    if (n >= 64) return join(low << (n - 64), 0);
    return join(high << n | low >> (64 - n), low << n);
}
// With what is shifted out as a sticky last bit.
VI_HD constexpr wide shift_right(wide m, int n) {
    const auto high = high_half(m), low = static_cast<unsigned long long>(m);
    if (n <= 0) return m;
    if (n > 127) return m != 0;
    const wide kept =
        n >= 64 ? wide(high >> (n - 64)) : join(high >> n, high << (64 - n) | low >> n);
    return kept | (shift_left(kept, n) != m);
}

VI_HD constexpr int length_of(wide m) { // position of the highest bit, plus one
    return high_half(m) ? 128 - __builtin_clzll(high_half(m))
                        : 64 - __builtin_clzll(static_cast<unsigned long long>(m));
}

// (-1)^negative m 2^e rounded to a double, m > 0.
VI_HD constexpr double rounded(bool negative, wide m, int e) {
    int drop = length_of(m) - 53;           // bits below the significand
    if (e + drop < -1074) drop = -1074 - e; // subnormal
    unsigned long long significand = 0;
    if (drop <= 0) {
        significand = static_cast<unsigned long long>(shift_left(m, -drop));
    } else {
        const wide kept = drop == 1 ? m << 1 : shift_right(m, drop - 2); // and half, sticky
        const auto last = static_cast<unsigned>(kept & 7);
        significand = static_cast<unsigned long long>(kept >> 2) + ((last & 2) && (last & 5));
    }
    e = e + drop;
    if (significand >> 53) {
        significand >>= 1;
        ++e;
    }
    unsigned long long b = significand;
    if (significand >> 52)
        b = (significand & 0xfffffffffffffull) + (static_cast<unsigned long long>(e + 1075) << 52);
    if (e + 1075 >= 2047) b = 0x7ffull << 52;
    return __builtin_bit_cast(double, b | static_cast<unsigned long long>(negative) << 63);
}

VI_HD constexpr bool is_finite(double x) {
    return (__builtin_bit_cast(unsigned long long, x) >> 52 & 0x7ff) != 0x7ff;
}

VI_HD constexpr double fma_in_whole_numbers(double a, double b, double c) {
    if (!is_finite(a) || !is_finite(b)) return a * b + c;
    if (!is_finite(c)) return c;
    const unpacked x = unpack(a), y = unpack(b), z = unpack(c);
    if (x.m == 0 || y.m == 0) return a * b + c;
    const bool negative = x.negative != y.negative;
    wide product = product_of(x.m, y.m); // < 2^106
    int e = x.e + y.e;
    if (z.m == 0) return rounded(negative, product, e);
    wide addend = z.m;
    // Both to one exponent, the larger moved to bit 125 first, the smaller down with a sticky bit.
    const int up = 126 - length_of(product), up_addend = 126 - length_of(addend);
    product = shift_left(product, up);
    addend = shift_left(addend, up_addend);
    e = e - up;
    const int e_addend = z.e - up_addend, top = e > e_addend ? e : e_addend;
    product = shift_right(product, top - e);
    addend = shift_right(addend, top - e_addend);
    if (negative == z.negative) return rounded(negative, product + addend, top);
    if (product == addend) return 0.0;
    return product > addend ? rounded(negative, product - addend, top)
                            : rounded(z.negative, addend - product, top);
}

// high + low, exactly.
struct two_parts {
    double high, low;
};
VI_HD constexpr two_parts exact_sum(double x, double y) { // Knuth
    const double s = x + y, from_y = s - x;
    return {s, (x - (s - from_y)) + (y - from_y)};
}
VI_HD constexpr two_parts halves(double x) { // of 26 bits each; Veltkamp
    const double t = 134217729.0 * x, high = t - (t - x);
    return {high, x - high};
}
VI_HD constexpr two_parts exact_product(double x, double y) { // Dekker
    const double p = x * y;
    const two_parts a = halves(x), b = halves(y);
    return {p, ((a.high * b.high - p) + a.high * b.low + a.low * b.high) + a.low * b.low};
}
// x + y; where it is between two doubles, the one of them whose last bit is set.
VI_HD constexpr double sum_to_odd(double x, double y) {
    const two_parts sum = exact_sum(x, y);
    const auto b = __builtin_bit_cast(unsigned long long, sum.high);
    if (sum.low == 0.0 || (b & 1)) return sum.high;
    return __builtin_bit_cast(double, (sum.high > 0.0) == (sum.low > 0.0) ? b + 1 : b - 1);
}

// 2^-range <= |x| < 2^(range + 1)
VI_HD constexpr bool is_within(double x, int range) {
    const auto exponent =
        static_cast<int>(__builtin_bit_cast(unsigned long long, x) >> 52 & 0x7ff) - 1023;
    return -range <= exponent && exponent <= range;
}

VI_HD constexpr double exact_fma(double a, double b, double c) {
    // The last bit of a product is 2^-904 or more, of an addend 2^-852: no part is subnormal.
    if (!is_within(a, 400) || !is_within(b, 400) || !(is_within(c, 800) || c == 0.0))
        return fma_in_whole_numbers(a, b, c);
    const two_parts product = exact_product(a, b);
    const two_parts low = exact_sum(c, product.low), high = exact_sum(product.high, low.high);
    return high.high + sum_to_odd(low.low, high.low);
}

} // namespace detail

#endif

VI_HD inline double fma(double a, double b, double c) {
#if defined(__CUDACC__) || defined(__CUDACC_RTC__)
    return ::fma(a, b, c);
#elif defined(__FMA__) || defined(__aarch64__)
    return __builtin_fma(a, b, c);
#elif defined(__wasm_relaxed_simd__)
    using pair = double __attribute__((vector_size(16)));
    return __builtin_wasm_relaxed_madd_f64x2(pair{a, a}, pair{b, b}, pair{c, c})[0];
#else
    return detail::exact_fma(a, b, c);
#endif
}

// c - a b with one rounding.
VI_HD inline double fnma(double a, double b, double c) {
    return fma(-a, b, c);
}

} // namespace vi
