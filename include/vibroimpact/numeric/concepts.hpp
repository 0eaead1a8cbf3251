// Requirements of the kernel on a number, and how plain double meets them.
//
// Every algorithm of the kernel is a template on its scalar T. Five kinds exist:
//
//     double                one trajectory
//     pack<N>               N trajectories side by side, one per SIMD lane        (pack.hpp)
//     jet<R, N>             a value of type R with N first derivatives            (jet.hpp)
//     mixed_jet<K>          a double with mixed derivatives in K directions       (mixed_jet.hpp)
//     counting<Tag>         a double that counts the operations done to it        (counting.hpp)
//
// A comparison of two scalars answers with a mask_t<T>: bool for one lane, pack_mask<N> for
// several. Code for all scalars therefore never writes `if (x < y)`, but either
//
//     x = select(x < y, a, b);            both sides are computed, each lane takes its own
//     while (any(active)) { ... }         the loop goes on until the last lane is done
//
// and joins masks by & | ! (never && ||, which no pack_mask has).
//
//     real_t<T>      T without its derivatives; value(x) returns it, comparisons look at it alone
//     mask_t<T>      what a comparison returns
//     lane_t<T>      the scalar of a single lane; lane(x, i) reads it, set_lane(x, i, s) writes it
//     bits_t<R>      the 64-bit pattern of each lane of a real R; bits(x), from_bits<R>(b)
//     fma(a, b, c)   a b + c with one rounding; sums of products are written with it
//     T(2.5)         every lane 2.5, derivatives zero
//
// Inside namespace vi, call these functions unqualified: argument-dependent lookup then finds the
// overloads of scalars that are included later. Outside, say `using vi::exp;` first, or a double
// goes to the C library.
#pragma once

#include "vibroimpact/numeric/fma.hpp"

namespace vi {

template <class T>
struct scalar_traits; // specialised by each scalar type

template <>
struct scalar_traits<double> {
    using real = double;
    using mask = bool;
    using lane = double;
    using bits = unsigned long long;
    static constexpr int lanes = 1;
    static constexpr bool is_jet = false;
};

template <class T>
using real_t = typename scalar_traits<T>::real;
template <class T>
using mask_t = typename scalar_traits<T>::mask;
template <class T>
using lane_t = typename scalar_traits<T>::lane;
template <class R>
using bits_t = typename scalar_traits<R>::bits;

template <class A, class B>
inline constexpr bool is_same = false;
template <class A>
inline constexpr bool is_same<A, A> = true;

// Plain double -----------------------------------------------------------------------------------

VI_HD constexpr double value(double x) {
    return x;
}
// The value of a single lane as a plain double, for decisions and for what is certified in double.
VI_HD constexpr double plain(double x) {
    return x;
}
VI_HD constexpr double select(bool mask, double a, double b) {
    return mask ? a : b;
}
VI_HD constexpr bool any(bool mask) {
    return mask;
}
VI_HD constexpr bool all(bool mask) {
    return mask;
}
VI_HD constexpr double lane(double x, int) {
    return x;
}
VI_HD constexpr bool lane(bool mask, int) {
    return mask;
}
VI_HD constexpr void set_lane(double& x, int, double s) {
    x = s;
}
VI_HD constexpr void set_lane(bool& mask, int, bool s) {
    mask = s;
}
VI_HD constexpr unsigned long long bits(double x) {
    return __builtin_bit_cast(unsigned long long, x);
}

// The real whose lanes have the given bit patterns: from_bits<R>(bits(x)) is x.
template <class R>
VI_HD constexpr R from_bits(const bits_t<R>& b) {
    if constexpr (is_same<R, double>)
        return __builtin_bit_cast(double, b);
    else
        return R::from_bits(b);
}

// The largest power of two that is not above a positive number.
VI_HD constexpr double power_of_two_below(double x) {
    return from_bits<double>(bits(x) >> 52 << 52);
}

VI_HD inline double sqrt(double x) {
#if defined(__CUDA_ARCH__)
    return __dsqrt_rn(x);
#else
    return __builtin_sqrt(x); // one instruction with -fno-math-errno
#endif
}

// Concepts ---------------------------------------------------------------------------------------

template <class T>
concept Scalar = requires(const T& x, T& changing, mask_t<T> mask) {
    T(1.0);
    T(x + x - x * x / x);
    T(-x);
    T(2.0 * x + 1.0);
    mask_t<T>(x < x);
    mask_t<T>(((x <= 0.0) & !(x == x)) | mask);
    T(select(mask, x, x));
    T(sqrt(x));
    T(fma(x, x, x));
    real_t<T>(value(x));
    lane_t<T>(lane(x, 0));
    set_lane(changing, 0, lane(x, 0));
    bool(any(mask) & all(mask));
};

// A scalar without derivatives: its bits can be taken, its elementary functions are in math.hpp.
template <class T>
concept Real =
    Scalar<T> && !scalar_traits<T>::is_jet && requires(const T& x) { from_bits<T>(bits(x)); };

static_assert(Real<double>);

} // namespace vi
