// N numbers in single precision side by side, for what is decided with a margin: half the bits, so
// twice as many in a register.
//
// floats<1> is a single one, beside double; others stand beside two packs of doubles, one after the
// other. Every lane gives the same bits as the same operation on a floats<1>: there are no other
// operations than these, so none is done in double by mistake. Rounding is to nearest, from doubles,
// too, and results may be subnormal; fma() has one rounding, with and without the instruction.
#pragma once

#include "vibroimpact/numeric/counting.hpp"
#include "vibroimpact/numeric/math.hpp"
#if !defined(__CUDACC__) && !defined(__CUDACC_RTC__)
#include "vibroimpact/numeric/pack.hpp"
#endif

namespace vi {

template <int N>
struct floats;

template <class R>
inline constexpr bool is_single = false;
template <int N>
inline constexpr bool is_single<floats<N>> = true;

// One --------------------------------------------------------------------------------------------

namespace detail {

// The sum rounded to odd in double, 29 bits longer, does not disturb the rounding that follows: the
// product is exact in double, and what its sum with c leaves out is known.
VI_HD inline float exact_fma(float a, float b, float c) {
    const double product = static_cast<double>(a) * b, sum = product + c;
    const auto [again, error] = exact_difference(product, -static_cast<double>(c));
    const bool even = (bits(sum) & 1) == 0, inexact = error > 0.0 || error < 0.0;
    if (!even || !inexact) return static_cast<float>(sum);
    const bool outwards = (error > 0.0) == (sum > 0.0);
    return static_cast<float>(from_bits<double>(outwards ? bits(sum) + 1 : bits(sum) - 1));
}

} // namespace detail

template <>
struct floats<1> {
    float v;

    floats() = default;
    VI_HD constexpr floats(double x) : v(static_cast<float>(x)) {}
    VI_HD static constexpr floats of(float x) {
        floats out{};
        out.v = x;
        return out;
    }

    VI_HD friend floats operator+(floats a, floats b) { return of(a.v + b.v); }
    VI_HD friend floats operator-(floats a, floats b) { return of(a.v - b.v); }
    VI_HD friend floats operator*(floats a, floats b) { return of(a.v * b.v); }
    VI_HD friend floats operator/(floats a, floats b) { return of(a.v / b.v); }
    VI_HD friend floats operator-(floats a) { return of(-a.v); }

    VI_HD friend bool operator<(floats a, floats b) { return a.v < b.v; }
    VI_HD friend bool operator<=(floats a, floats b) { return a.v <= b.v; }
    VI_HD friend bool operator>(floats a, floats b) { return a.v > b.v; }
    VI_HD friend bool operator>=(floats a, floats b) { return a.v >= b.v; }
    VI_HD friend bool operator==(floats a, floats b) { return a.v == b.v; }

    VI_HD friend floats fma(floats a, floats b, floats c) {
#if defined(__CUDACC__) || defined(__CUDACC_RTC__)
        return of(::fmaf(a.v, b.v, c.v));
#elif defined(__FMA__) || defined(__aarch64__)
        return of(__builtin_fmaf(a.v, b.v, c.v));
#else
        return of(detail::exact_fma(a.v, b.v, c.v));
#endif
    }
    VI_HD friend floats fnma(floats a, floats b, floats c) { return fma(-a, b, c); }
    VI_HD friend floats select(bool mask, floats a, floats b) { return mask ? a : b; }
    VI_HD friend floats abs(floats x) {
#if defined(__CUDACC__) || defined(__CUDACC_RTC__)
        return of(__builtin_bit_cast(float, __builtin_bit_cast(unsigned, x.v) & 0x7fffffffu));
#else
        return of(__builtin_fabsf(x.v));
#endif
    }
    VI_HD friend floats min(floats a, floats b) { return b < a ? b : a; }
    VI_HD friend floats max(floats a, floats b) { return b > a ? b : a; }
    VI_HD friend floats only(bool mask, floats x) { return mask ? x : of(0.0f); }
    VI_HD friend floats plus_where(bool mask, floats x, floats y) { return mask ? x + y : x; }
};

// The single precision that goes with a real.
template <class R>
struct single_of {
    using type = R; // that counts operations: as many of them
};
template <>
struct single_of<double> {
    using type = floats<1>;
};
template <class R>
using single_t = typename single_of<R>::type;

template <>
struct scalar_traits<floats<1>> {
    using mask = bool;
    static constexpr int lanes = 1;
    static constexpr bool is_jet = false;
};
VI_HD inline void set_lane(floats<1>& x, int, floats<1> s) {
    x = s;
}
VI_HD inline floats<1> lane(floats<1> x, int) {
    return x;
}

template <class Tag>
VI_HD counting<Tag>::counting(const floats<1>& x) : v(x.v) {}

// What stands for one scalar, again in double.
template <int, class R>
VI_HD constexpr R half(const R& x) {
    return x;
}
template <int>
VI_HD inline double half(floats<1> x) {
    return x.v;
}

// Several ----------------------------------------------------------------------------------------

#if !defined(__CUDACC__) && !defined(__CUDACC_RTC__)

template <int N>
struct float_vector {
    typedef float type __attribute__((vector_size(4 * N)));
};
// As truth_values of doubles.
template <int N>
struct float_truth {
    typedef int type __attribute__((vector_size(4 * N)));
};
#if defined(__AVX512F__)
template <>
struct float_truth<16> {
    using type = __mmask16;
};
#endif

template <int N>
struct float_mask {
    using values = typename float_truth<N>::type;
    static constexpr bool has_bit_per_lane = sizeof(values) == 2;
    values v;

    float_mask() = default;
    explicit float_mask(bool b) : v(static_cast<values>(values{} - static_cast<int>(b))) {}
    explicit float_mask(const values& lanes) : v(lanes) {}

    friend float_mask operator&(const float_mask& a, const float_mask& b) {
        return float_mask(static_cast<values>(a.v & b.v));
    }
    friend float_mask operator|(const float_mask& a, const float_mask& b) {
        return float_mask(static_cast<values>(a.v | b.v));
    }
    friend float_mask operator!(const float_mask& a) {
        return float_mask(static_cast<values>(~a.v));
    }
};

template <int N>
bool any(const float_mask<N>& mask) {
#if defined(__AVX__)
    if constexpr (N == 8) return _mm256_movemask_ps(__m256(mask.v)) != 0;
#endif
    if constexpr (float_mask<N>::has_bit_per_lane) {
        return mask.v != 0;
    } else {
        int joined = 0;
        for (int i = 0; i < N; ++i)
            joined |= mask.v[i];
        return joined != 0;
    }
}

template <int N>
struct floats {
    using enum comparison;
    static_assert(N == 4 || N == 8 || N == 16);
    using vector = typename float_vector<N>::type;
    typedef int bit_vector __attribute__((vector_size(4 * N)));
    using mask = float_mask<N>;
    vector v;

    floats() = default;
    floats(floats<1> x) : v(x.v - vector{}) {} // x - 0 is x, also for -0
    floats(double x) : floats(floats<1>(x)) {}
    explicit floats(const vector& lanes) : v(lanes) {}

    friend floats operator+(const floats& a, const floats& b) { return floats(a.v + b.v); }
    friend floats operator-(const floats& a, const floats& b) { return floats(a.v - b.v); }
    friend floats operator*(const floats& a, const floats& b) { return floats(a.v * b.v); }
    friend floats operator/(const floats& a, const floats& b) { return floats(a.v / b.v); }
    friend floats operator-(const floats& a) { return floats(-a.v); }

    friend mask operator<(const floats& a, const floats& b) { return compared<less>(a, b); }
    friend mask operator<=(const floats& a, const floats& b) { return compared<at_most>(a, b); }
    friend mask operator>(const floats& a, const floats& b) { return compared<less>(b, a); }
    friend mask operator>=(const floats& a, const floats& b) { return compared<at_most>(b, a); }
    friend mask operator==(const floats& a, const floats& b) { return compared<equal>(a, b); }

    friend floats fma(const floats& a, const floats& b, const floats& c) { return fused(a, b, c); }
    friend floats fnma(const floats& a, const floats& b, const floats& c) {
        return fused(-a, b, c);
    }
    friend floats select(const mask& m, const floats& a, const floats& b) {
        return chosen(m, a, b);
    }
    friend floats abs(const floats& x) { return floats(vector(bit_vector(x.v) & 0x7fffffff)); }
};

template <int N>
struct scalar_traits<floats<N>> {
    using mask = float_mask<N>;
    static constexpr int lanes = N;
    static constexpr bool is_jet = false;
};
template <int N>
struct single_of<pack<N>> {
    using type = floats<2 * N>; // of two packs
};

#if defined(__AVX512F__)
template <comparison What>
float_mask<16> compared(const floats<16>& a, const floats<16>& b) {
    using enum comparison;
    constexpr int code = What == less ? _CMP_LT_OS : What == at_most ? _CMP_LE_OS : _CMP_EQ_OQ;
    return float_mask<16>(_mm512_cmp_ps_mask(a.v, b.v, code));
}
#endif
template <comparison What, int N>
float_mask<N> compared(const floats<N>& a, const floats<N>& b) {
    using enum comparison;
    if constexpr (What == less)
        return float_mask<N>(a.v < b.v);
    else if constexpr (What == at_most)
        return float_mask<N>(a.v <= b.v);
    else
        return float_mask<N>(a.v == b.v);
}

template <int N>
floats<N> fused(const floats<N>& a, const floats<N>& b, const floats<N>& c) {
#if defined(__FMA__)
    if constexpr (N == 4) return floats<N>(_mm_fmadd_ps(a.v, b.v, c.v));
    if constexpr (N == 8) return floats<N>(_mm256_fmadd_ps(a.v, b.v, c.v));
#endif
#if defined(__AVX512F__)
    if constexpr (N == 16) return floats<N>(_mm512_fmadd_ps(a.v, b.v, c.v));
#elif defined(__aarch64__)
    if constexpr (N == 4) return floats<N>(vfmaq_f32(c.v, a.v, b.v));
#endif
    floats<N> sum;
    for (int i = 0; i < N; ++i)
        sum.v[i] = fma(lane(a, i), lane(b, i), lane(c, i)).v;
    return sum;
}

template <int N>
floats<N> chosen(const float_mask<N>& m, const floats<N>& a, const floats<N>& b) {
#if defined(__AVX__)
    if constexpr (N == 8) return floats<N>(_mm256_blendv_ps(b.v, a.v, __m256(m.v)));
#endif
#if defined(__AVX512F__)
    if constexpr (N == 16)
        return floats<N>(_mm512_mask_blend_ps(m.v, b.v, a.v));
    else
#endif
        return floats<N>(m.v ? a.v : b.v);
}
template <int N>
floats<N> only(const float_mask<N>& m, const floats<N>& x) {
    using vector = typename floats<N>::vector;
    using bit_vector = typename floats<N>::bit_vector;
#if defined(__AVX512F__)
    if constexpr (N == 16)
        return floats<N>(vector(_mm512_maskz_mov_ps(m.v, x.v)));
    else
#endif
        return floats<N>(vector(bit_vector(x.v) & m.v));
}
// As math.hpp says: no negative zero.
template <int N>
floats<N> plus_where(const float_mask<N>& m, const floats<N>& x, const floats<N>& y) {
#if defined(__AVX512F__)
    if constexpr (N == 16) return floats<N>(_mm512_mask_add_ps(x.v, m.v, x.v, y.v));
#endif
    return x + only(m, y);
}
template <int N>
floats<N> min(const floats<N>& a, const floats<N>& b) {
#if defined(__AVX__)
    if constexpr (N == 8) return floats<N>(_mm256_min_ps(b.v, a.v));
#endif
#if defined(__AVX512F__)
    if constexpr (N == 16) return floats<N>(_mm512_min_ps(b.v, a.v));
#endif
    return select(b < a, b, a);
}
template <int N>
floats<N> max(const floats<N>& a, const floats<N>& b) {
#if defined(__AVX__)
    if constexpr (N == 8) return floats<N>(_mm256_max_ps(b.v, a.v));
#endif
#if defined(__AVX512F__)
    if constexpr (N == 16) return floats<N>(_mm512_max_ps(b.v, a.v));
#endif
    return select(b > a, b, a);
}

template <int N>
floats<1> lane(const floats<N>& x, int i) {
    return floats<1>::of(x.v[i]);
}
template <int N>
void set_lane(floats<N>& x, int i, floats<1> s) {
    x.v[i] = s.v;
}

// Two packs of doubles one after the other, rounded.
template <int N>
floats<2 * N> joined(const pack<N>& a, const pack<N>& b) {
    using vector = typename float_vector<N>::type;
    const vector x = __builtin_convertvector(a.v, vector);
    const vector y = __builtin_convertvector(b.v, vector);
#if defined(__AVX512F__)
    if constexpr (N == 8) {
        const __m512d first = _mm512_castps_pd(_mm512_castps256_ps512(x));
        return floats<16>(_mm512_castpd_ps(_mm512_insertf64x4(first, _mm256_castps_pd(y), 1)));
    }
#endif
    if constexpr (N == 2)
        return floats<4>(__builtin_shufflevector(x, y, 0, 1, 2, 3));
    else if constexpr (N == 4)
        return floats<8>(__builtin_shufflevector(x, y, 0, 1, 2, 3, 4, 5, 6, 7));
    else
        return floats<16>(
            __builtin_shufflevector(x, y, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15));
}

// Elements of the first half, or of the second.
template <int Which, class Vector>
auto half_of(const Vector& x) {
    constexpr int count = sizeof(Vector) / 4, at = Which * count / 2;
    if constexpr (count == 4)
        return __builtin_shufflevector(x, x, at, at + 1);
    else if constexpr (count == 8)
        return __builtin_shufflevector(x, x, at, at + 1, at + 2, at + 3);
    else
        return __builtin_shufflevector(x, x, at, at + 1, at + 2, at + 3, at + 4, at + 5, at + 6,
                                       at + 7);
}

// What stands for one of the packs, again in double.
template <int Which, int N>
pack<N / 2> half(const floats<N>& x) {
    using vector = typename pack<N / 2>::vector;
#if defined(__AVX512F__)
    if constexpr (N == 16) {
        const __m256d mine = _mm512_extractf64x4_pd(_mm512_castps_pd(x.v), Which);
        return pack<8>(_mm512_cvtps_pd(_mm256_castpd_ps(mine)));
    }
#endif
    return pack<N / 2>(vector(__builtin_convertvector(half_of<Which>(x.v), vector)));
}
template <int Which, int N>
pack_mask<N / 2> half(const float_mask<N>& m) {
    using values = typename pack_mask<N / 2>::values;
    if constexpr (float_mask<N>::has_bit_per_lane)
        return pack_mask<N / 2>(static_cast<values>(m.v >> (Which * N / 2)));
    else
        return pack_mask<N / 2>(values(__builtin_convertvector(half_of<Which>(m.v), values)));
}

#endif

} // namespace vi
