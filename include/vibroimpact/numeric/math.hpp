// Elementary functions of the kernel, for every scalar of numeric/concepts.hpp.
//
// Only + - * / sqrt, comparisons and integer work on bit patterns are used: operations that are
// exactly the same on every target. No fused multiply-add, no library call, no table, no if: a
// double goes through the same operations as each lane of a pack, so the bits agree everywhere.
// Compile with -ffp-contract=off.
//
//     function      error in ulp          domain
//                   bound  (measured)
//     sincos(x)     1      (0.84)         |x| <= 2^20, next to multiples of pi/2 too; NaN beyond
//     exp(x)        1      (0.82)         all; infinity above 709.78, gradual underflow below
//                                         -708.4, 0 below -745.13
//     log(x)        1      (0.83)         all, subnormal too; log(0) = -infinity, NaN below 0
//     atan2(y, x)   2      (1.6)          all, with C's rules for zeros and infinities
//     abs min max copysign floor nearbyint: exact; sqrt: correctly rounded
//
// Measured on some 10^7 arguments each; the tests hold the bounds on thousands, hard ones included.
//
// A NaN argument gives NaN (min, max: see there). sincos(-x) and atan2(-y, x) mirror exactly, zeros
// keep their sign. Derivatives: numeric/jet.hpp overloads what is smooth.
//
// The polynomial coefficients and the split constants are printed by tools/math_coefficients.py,
// which states their truncation errors; a test compares them.
#pragma once

#include "vibroimpact/numeric/concepts.hpp"

namespace vi {

inline constexpr double pi = 3.1415926535897931;

VI_HD constexpr double infinity() {
    return from_bits<double>(0x7ff0000000000000ULL);
}
VI_HD constexpr double not_a_number() {
    return from_bits<double>(0x7ff8000000000000ULL);
}

template <class T>
struct sine_cosine {
    T s, c;
};

namespace detail {

inline constexpr unsigned long long sign_bit = 0x8000000000000000ULL;
inline constexpr unsigned long long one_bits = 0x3ff0000000000000ULL;

// Adding this to |x| < 2^51 rounds x to an integer, ties to even, and leaves that integer in the
// low bits: 1.5 * 2^52.
inline constexpr double round_shift = 6755399441055744.0;

// c0 + w (c2 + w (c4 + ...)) of the coefficients c0, c1, c2, ...
template <Real T, class... C>
VI_HD T every_other(const T&, double c0, C...)
    requires(sizeof...(C) < 2)
{
    return T(c0);
}
template <Real T, class... C>
VI_HD T every_other(const T& w, double c0, double, double c2, C... rest) {
    return c0 + w * every_other(w, c2, rest...);
}

// c0 + c1 z + c2 z^2 + ..., even and odd powers as two Horner schemes in z^2: half the waiting.
template <Real T, class... C>
VI_HD T polynomial(const T& z, double c0, C... rest) {
    const T w = z * z;
    return every_other(w, c0, rest...) + z * every_other(w, rest...);
}

template <Real T>
struct sum_and_error {
    T sum, error;
};

// a - b = sum + error exactly (Knuth).
template <Real T>
VI_HD sum_and_error<T> exact_difference(const T& a, const T& b) {
    const T sum = a - b;
    const T from_b = sum - a;
    return {sum, (a - (sum - from_b)) - (b + from_b)};
}

// 2^k for the integer that `shifted` = k + round_shift carries in its low bits, -1022 <= k <= 1023.
template <Real T>
VI_HD T power_of_two(const T& shifted) {
    return from_bits<T>((bits(shifted) << 52) + one_bits);
}

} // namespace detail

// Sign, order, rounding --------------------------------------------------------------------------

template <Real T>
VI_HD T abs(const T& x) {
    return from_bits<T>(bits(x) & ~detail::sign_bit);
}

#if !defined(__CUDACC__) && !defined(__CUDACC_RTC__)
// For doubles by the builtin: GCC would take the bits to another register and back.
constexpr double abs(double x) {
    return __builtin_fabs(x);
}
#endif

template <Scalar T>
    requires(!Real<T>)
VI_HD T abs(const T& x) {
    return select(x < 0.0, -x, x);
}

// x where the mask holds, 0 elsewhere.
template <Scalar T>
VI_HD T only(const mask_t<T>& mask, const T& x) {
    return select(mask, x, T(0.0));
}
// x + y where the mask holds, x elsewhere (no negative zero).
template <Scalar T>
VI_HD T plus_where(const mask_t<T>& mask, const T& x, const T& y) {
    return x + only(mask, y);
}

// The first of equals. A NaN loses if it is second and wins if it is first.
template <Scalar T>
VI_HD T min(const T& a, const T& b) {
    return select(b < a, b, a);
}

template <Scalar T>
VI_HD T max(const T& a, const T& b) {
    return select(b > a, b, a);
}

// |magnitude| with the sign of `sign`, zeros included.
template <Real T>
VI_HD T copysign(const T& magnitude, const T& sign) {
    return from_bits<T>((bits(magnitude) & ~detail::sign_bit) | (bits(sign) & detail::sign_bit));
}

// The nearest integer, ties to even.
template <Real T>
VI_HD T nearbyint(const T& x) {
    constexpr double two_52 = 4503599627370496.0; // from here on every double is an integer
    const T size = abs(x);
    const T rounded = copysign((size + two_52) - two_52, x);
    return select(size < two_52, rounded, x);
}

template <Real T>
VI_HD T floor(const T& x) {
    const T nearest = nearbyint(x);
    return select(nearest > x, nearest - 1.0, nearest);
}

// Sine and cosine --------------------------------------------------------------------------------

namespace detail {

// x = n pi/2 + r + tail with |r| <= pi/4 and |tail| <= 2^-16 |r|; `shifted` carries n in its low
// bits.
//
// Cody and Waite: pi/2 = p1 + p2 + p3 + p4, 33 bits in each of the first three, so that n p1, n p2
// and n p3 are exact for |n| < 2^20. x - n p1 is exact because both are multiples of a common unit
// and nearly equal; the next two differences keep their rounding errors in the tail. The error
// left, of n p4 and of pi/2 itself, is below 2^-130, and no double in the range is closer than
// 2^-62 to a multiple of pi/2: 60 bits of r + tail are right.
template <Real T>
struct quarter_turns {
    T r, tail, shifted;
};

template <Real T>
VI_HD quarter_turns<T> reduce_quarter_turns(const T& x) {
    const T shifted = x * 6.3661977236758138e-01 /* 2/pi */ + round_shift;
    const T n = shifted - round_shift;
    const T first = x - n * 1.5707963267341256e+00;
    const auto second = exact_difference<T>(first, n * 6.0771005063039660e-11);
    const auto third = exact_difference<T>(second.sum, n * 2.0222662487111665e-21);
    const T tail = (second.error + third.error) - n * 8.4784276603688996e-32;
    return {third.sum, tail, shifted};
}

// sin(r + tail) = r + tail + r z S(z) - tail z/2 and cos(r + tail) = 1 - z/2 + z^2 C(z) - r tail
// with z = r^2; the large terms are added last, and the rounding error of 1 - z/2 is put back.
template <Real T>
VI_HD sine_cosine<T> sincos_reduced(const T& r, const T& tail) {
    const T z = r * r;
    const T w = z * z;
    const T sine =
        polynomial(z, -1.6666666666666632e-01, 8.3333333333224183e-03, -1.9841269829812066e-04,
                   2.7557313693636439e-06, -2.5050758418269561e-08, 1.5896815007836776e-10);
    const T cosine =
        polynomial(z, 4.1666666666666644e-02, -1.3888888888882061e-03, 2.4801587294420231e-05,
                   -2.7557315764798660e-07, 2.0875912664852156e-09, -1.1369298846560313e-11);
    const T half = 0.5 * z;
    const T head = 1.0 - half;
    return {r + (r * (z * sine) + (tail - tail * half)),
            head + (((1.0 - head) - half) + (w * cosine - r * tail))};
}

} // namespace detail

// By quadrant n mod 4: (s, c), (c, -s), (-s, -c), (-c, s).
template <Real T>
VI_HD sine_cosine<T> sincos(const T& x) {
    constexpr double limit = 1048576.0; // 2^20
    const auto turned = detail::reduce_quarter_turns(x);
    const T tail = select(abs(x) <= limit, turned.tail, T(not_a_number())); // in time, costs least
    const auto f = detail::sincos_reduced(turned.r, tail);
    const auto n = bits(turned.shifted);
    const auto sine = bits(f.s);
    const auto cosine = bits(f.c);
    const auto swap = (sine ^ cosine) & (0ULL - (n & 1ULL));
    const T s = from_bits<T>((sine ^ swap) ^ ((n & 2ULL) << 62));
    const T c = from_bits<T>((cosine ^ swap) ^ (((n + 1ULL) & 2ULL) << 62));
    return {select(x == 0.0, x, s), c}; // the reduction loses the sign of zero
}

// Exponential and logarithm ----------------------------------------------------------------------

// exp(x) = 2^k exp(r), r = x - k ln 2 = high - low, |r| <= ln(2)/2; k ln2_high is exact.
// exp(r) = 1 + r + r^2 E(r) with the rounding error of 1 + high put back. 2^k is applied in two
// halves, so that overflow and gradual underflow happen in the last multiplication only.
template <Real T>
VI_HD T exp(const T& x) {
    constexpr double highest = 710.0; // exp overflows
    constexpr double lowest = -746.0; // exp is less than half the smallest subnormal
    const T y = max(min(x, T(highest)), T(lowest));
    const T k =
        (y * 1.4426950408889634e+00 /* 1/ln 2 */ + detail::round_shift) - detail::round_shift;
    const T high = y - k * 6.9314718036912382e-01;
    const T low = k * 1.9082149292705877e-10;
    const T r = high - low;
    const T z = r * r;
    const T series =
        detail::polynomial(r, 5.0000000000000011e-01, 1.6666666666666669e-01,
                           4.1666666666624164e-02, 8.3333333333300650e-03, 1.3888888917196719e-03,
                           1.9841269863040545e-04, 2.4801521322368692e-05, 2.7557268480310024e-06,
                           2.7620075879983367e-07, 2.5100375832561234e-08);
    const T head = 1.0 + high;
    const T f = head + (((1.0 - head) + high) + (z * series - low));
    const T half_shifted = 0.5 * k + detail::round_shift;
    const T rest_shifted = (k - (half_shifted - detail::round_shift)) + detail::round_shift;
    return (f * detail::power_of_two(half_shifted)) * detail::power_of_two(rest_shifted);
}

// x = 2^k m with sqrt(1/2) <= m < sqrt(2), f = m - 1, s = f / (2 + f):
// log(m) = 2 s + s z L(z) = f - (f^2/2 - s (f^2/2 + z L(z))) with z = s^2.
template <Real T>
VI_HD T log(const T& x) {
    constexpr double smallest_normal = 2.2250738585072014e-308;
    constexpr double two_54 = 18014398509481984.0;
    constexpr unsigned long long root_half_bits = 0x3fe6a09e667f3bcdULL; // sqrt(1/2)
    constexpr unsigned long long two_52_bits = 0x4330000000000000ULL;
    const mask_t<T> subnormal = x < smallest_normal;
    const auto b = bits(select(subnormal, x * two_54, x));
    const auto biased = (b + (detail::one_bits - root_half_bits)) >> 52; // k + 1023
    const T exponent = from_bits<T>(biased | two_52_bits) - (4503599627370496.0 + 1023.0);
    const T k = exponent - select(subnormal, T(54.0), T(0.0));
    const T f = from_bits<T>(b - (biased << 52) + detail::one_bits) - 1.0;
    const T s = f / (2.0 + f);
    const T z = s * s;
    const T series =
        detail::polynomial(z, 6.6666666666667340e-01, 3.9999999999419228e-01,
                           2.8571428741387556e-01, 2.2222198674303803e-01, 1.8183559156962295e-01,
                           1.5314180535040267e-01, 1.4794671725144501e-01);
    const T half = 0.5 * (f * f);
    const T low = k * 1.9082149292705877e-10;
    const T y = k * 6.9314718036912382e-01 - ((half - (s * (half + z * series) + low)) - f);
    const T finite = select(x == 0.0, T(-infinity()), select(x < infinity(), y, x));
    return select(x < 0.0, T(not_a_number()), finite);
}

// Angle ------------------------------------------------------------------------------------------

// With a <= b the two sizes, atan(a / b) is atan(u) with u = a / b, or pi/4 + atan(u) with
// u = (a - b) / (a + b) where a > b/2, which makes a - b exact; |u| <= 1/2. The octants then add a
// multiple of pi/4 and perhaps a sign: angle = m pi/4 +- atan(u), with pi/4 in two parts, m times
// the first exact.
template <Real T>
VI_HD T atan2(const T& y, const T& x) {
    constexpr double large = 8.9884656743115795e+307; // 2^1023: a + b could overflow
    const T size_x = abs(x);
    const T size_y = abs(y);
    const mask_t<T> steep = size_y > size_x;
    const mask_t<T> left = copysign(T(1.0), x) < 0.0;
    const T larger = select(steep, size_y, size_x);
    const T smaller = select(steep, size_x, size_y);
    // Infinity counts as 1 beside finite numbers, which count as 0; beside (0, 0) stands b = 1.
    const mask_t<T> infinite = larger == infinity();
    const T scale = select(larger >= large, T(0.25), T(1.0));
    const T b = select(infinite | (larger == 0.0), T(1.0), larger * scale);
    const T a_infinite =
        select(smaller == infinity(), T(1.0), select(smaller == smaller, T(0.0), smaller));
    const T a = select(infinite, a_infinite, smaller * scale);
    const mask_t<T> offset = a > 0.5 * b;
    const T u = select(offset, a - b, a) / select(offset, a + b, b);
    const T z = u * u;
    const T series =
        detail::polynomial(z, -3.3333333333333309e-01, 1.9999999999992946e-01,
                           -1.4285714284930437e-01, 1.1111111067116404e-01, -9.0909076295145316e-02,
                           7.6922763677295114e-02, -6.6662105967731297e-02, 5.8777036633553680e-02,
                           -5.2294464327008898e-02, 4.5873601008993223e-02, -3.7069167155721339e-02,
                           2.3586555016089240e-02, -8.3238784225220606e-03);
    const T correction = u * (z * series);
    const T first = select(offset, T(1.0), T(0.0));
    const T second = select(steep, 2.0 - first, first);
    const T m = select(left, 4.0 - second, second);
    const T sign = select(steep, T(-1.0), T(1.0)) * select(left, T(-1.0), T(1.0));
    const T high = m * 7.8539816339744828e-01;
    const T low = m * 3.0616169978683830e-17;
    return copysign(high + (sign * u + (sign * correction + low)), y);
}

// The whole number nearest to x, |x| < 2^51.
template <Real T>
VI_HOT T nearest(const T& x) {
    return (x + detail::round_shift) - detail::round_shift;
}

} // namespace vi
