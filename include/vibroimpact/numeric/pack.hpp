// N doubles side by side, one trajectory per SIMD lane, on the vector extensions of GCC and Clang.
//
// Each lane gives the same bits as the same operation on a double: + - * / and sqrt are correctly
// rounded in every instruction set, and no operation looks across lanes except any(), all(),
// lane(). Choose N by the register (2, 4, 8); for more work in flight use several packs, not a
// wider one.
//
// GCC warns once (-Wpsabi) where a pack is wider than the target's registers: how such a value is
// passed differs between targets. Packs never cross a library boundary; compile with -Wno-psabi.
#pragma once

#include "vibroimpact/numeric/concepts.hpp"

#if defined(__FMA__) || defined(__AVX__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace vi {

// Number of lanes of a register of the target.
#if defined(__AVX512F__)
inline constexpr int native_lanes = 8;
#elif defined(__AVX__)
inline constexpr int native_lanes = 4;
#else
inline constexpr int native_lanes = 2;
#endif

// Truth values side by side: all bits of a lane set or none. AVX-512 has registers with a bit per
// lane; GCC would move vectors there and back.
template <int N>
struct truth_values {
    typedef long long type __attribute__((vector_size(8 * N)));
};
#if defined(__AVX512F__)
template <>
struct truth_values<8> {
    using type = __mmask8;
};
#endif
template <int N>
inline constexpr bool has_bit_per_lane = sizeof(typename truth_values<N>::type) == 1;

// One truth value per lane.
template <int N>
struct pack_mask {
    using values = typename truth_values<N>::type;
    values v;

    pack_mask() = default;
    explicit pack_mask(bool b) : v(static_cast<values>(values{} - static_cast<long long>(b))) {}
    explicit pack_mask(const values& lanes) : v(lanes) {}

    friend pack_mask operator&(const pack_mask& a, const pack_mask& b) {
        return pack_mask(static_cast<values>(a.v & b.v));
    }
    friend pack_mask operator|(const pack_mask& a, const pack_mask& b) {
        return pack_mask(static_cast<values>(a.v | b.v));
    }
    friend pack_mask operator!(const pack_mask& a) { return pack_mask(static_cast<values>(~a.v)); }
    pack_mask& operator&=(const pack_mask& b) { return *this = *this & b; }
    pack_mask& operator|=(const pack_mask& b) { return *this = *this | b; }
};

template <int N>
bool any(const pack_mask<N>& mask) {
#if defined(__AVX__)
    if constexpr (N == 4) return _mm256_movemask_pd(__m256d(mask.v)) != 0;
#endif
    if constexpr (has_bit_per_lane<N>) {
        return mask.v != 0;
    } else {
        long long joined = 0;
        for (int i = 0; i < N; ++i)
            joined |= mask.v[i];
        return joined != 0;
    }
}

template <int N>
bool all(const pack_mask<N>& mask) {
    return !any(!mask);
}

template <int N>
bool lane(const pack_mask<N>& mask, int i) {
    if constexpr (has_bit_per_lane<N>)
        return (mask.v >> i & 1) != 0;
    else
        return mask.v[i] != 0;
}

template <int N>
void set_lane(pack_mask<N>& mask, int i, bool s) {
    if constexpr (has_bit_per_lane<N>)
        mask.v = static_cast<typename pack_mask<N>::values>((mask.v & ~(1 << i)) | (s << i));
    else
        mask.v[i] = -static_cast<long long>(s);
}

enum class comparison { less, at_most, equal, unequal };

template <int N>
struct pack {
    using enum comparison;
    static_assert(N == 2 || N == 4 || N == 8);
    typedef double vector __attribute__((vector_size(8 * N)));
    typedef unsigned long long bit_vector __attribute__((vector_size(8 * N)));
    using mask = pack_mask<N>;
    vector v;

    pack() = default;
    pack(double x) : v(x - vector{}) {} // x - 0 is x, also for -0
    explicit pack(const vector& lanes) : v(lanes) {}
    static pack from_bits(const bit_vector& b) { return pack(vector(b)); }

    friend pack operator+(const pack& a, const pack& b) { return pack(a.v + b.v); }
    friend pack operator-(const pack& a, const pack& b) { return pack(a.v - b.v); }
    friend pack operator*(const pack& a, const pack& b) { return pack(a.v * b.v); }
    friend pack operator/(const pack& a, const pack& b) { return pack(a.v / b.v); }
    friend pack operator-(const pack& a) { return pack(-a.v); }
    pack& operator+=(const pack& b) { return *this = *this + b; }
    pack& operator-=(const pack& b) { return *this = *this - b; }
    pack& operator*=(const pack& b) { return *this = *this * b; }
    pack& operator/=(const pack& b) { return *this = *this / b; }

    friend mask operator<(const pack& a, const pack& b) { return compared<less>(a, b); }
    friend mask operator<=(const pack& a, const pack& b) { return compared<at_most>(a, b); }
    friend mask operator>(const pack& a, const pack& b) { return compared<less>(b, a); }
    friend mask operator>=(const pack& a, const pack& b) { return compared<at_most>(b, a); }
    friend mask operator==(const pack& a, const pack& b) { return compared<equal>(a, b); }
    friend mask operator!=(const pack& a, const pack& b) { return compared<unequal>(a, b); }

    friend pack fma(const pack& a, const pack& b, const pack& c) { return fused(a, b, c); }
    friend pack fnma(const pack& a, const pack& b, const pack& c) { return fused_away(a, b, c); }
    friend pack select(const mask& m, const pack& a, const pack& b) { return chosen(m, a, b); }
};

#if defined(__AVX512F__)
template <comparison What>
pack_mask<8> compared(const pack<8>& a, const pack<8>& b) {
    using enum comparison;
    constexpr int code = What == less      ? _CMP_LT_OS
                         : What == at_most ? _CMP_LE_OS
                         : What == equal   ? _CMP_EQ_OQ
                                           : _CMP_NEQ_UQ;
    return pack_mask<8>(_mm512_cmp_pd_mask(a.v, b.v, code));
}
#endif
template <comparison What, int N>
pack_mask<N> compared(const pack<N>& a, const pack<N>& b) {
    using enum comparison;
    if constexpr (What == less)
        return pack_mask<N>(a.v < b.v);
    else if constexpr (What == at_most)
        return pack_mask<N>(a.v <= b.v);
    else if constexpr (What == equal)
        return pack_mask<N>(a.v == b.v);
    else
        return pack_mask<N>(a.v != b.v);
}

template <int N>
pack<N> fused(const pack<N>& a, const pack<N>& b, const pack<N>& c) {
#if defined(__FMA__)
    if constexpr (N == 2) return pack<N>(_mm_fmadd_pd(a.v, b.v, c.v));
    if constexpr (N == 4) return pack<N>(_mm256_fmadd_pd(a.v, b.v, c.v));
#endif
#if defined(__AVX512F__)
    if constexpr (N == 8) return pack<N>(_mm512_fmadd_pd(a.v, b.v, c.v));
#elif defined(__aarch64__)
    if constexpr (N == 2) return pack<N>(vfmaq_f64(c.v, a.v, b.v));
#endif
    pack<N> sum;
    for (int i = 0; i < N; ++i)
        sum.v[i] = fma(a.v[i], b.v[i], c.v[i]);
    return sum;
}

template <int N>
pack<N> fused_away(const pack<N>& a, const pack<N>& b, const pack<N>& c) {
#if defined(__FMA__)
    if constexpr (N == 2) return pack<N>(_mm_fnmadd_pd(a.v, b.v, c.v));
    if constexpr (N == 4) return pack<N>(_mm256_fnmadd_pd(a.v, b.v, c.v));
#endif
    return fused(-a, b, c);
}

// GCC compares a mask that it did not just compute with zero again.
template <int N>
pack<N> chosen(const pack_mask<N>& m, const pack<N>& a, const pack<N>& b) {
#if defined(__AVX__)
    if constexpr (N == 4) return pack<N>(_mm256_blendv_pd(b.v, a.v, __m256d(m.v)));
#endif
#if defined(__AVX512F__)
    if constexpr (N == 8)
        return pack<N>(_mm512_mask_blend_pd(m.v, b.v, a.v));
    else
#endif
        return pack<N>(m.v ? a.v : b.v);
}

template <int N>
struct scalar_traits<pack<N>> {
    using real = pack<N>;
    using mask = pack_mask<N>;
    using lane = double;
    using bits = typename pack<N>::bit_vector;
    static constexpr int lanes = N;
    static constexpr bool is_jet = false;
};

template <int N>
pack<N> value(const pack<N>& x) {
    return x;
}

// From where x stands: GCC would read all of x.v first, and write it elsewhere, to find lane i.
template <int N>
double lane(const pack<N>& x, int i) {
    double out;
    __builtin_memcpy(&out, reinterpret_cast<const char*>(&x) + i * sizeof out, sizeof out);
    return out;
}

template <int N>
void set_lane(pack<N>& x, int i, double s) {
    x.v[i] = s;
}

template <int N>
bits_t<pack<N>> bits(const pack<N>& x) {
    return bits_t<pack<N>>(x.v);
}

template <int N>
pack<N> sqrt(const pack<N>& x) {
    pack<N> root;
    for (int i = 0; i < N; ++i)
        root.v[i] = sqrt(x.v[i]);
    return root;
}

// The entry at each lane's own place in a table of its own: the distance in bytes, a whole number, is the
// last bits of its sum with 2^52.
template <int N, class Entry>
VI_HOT void places_of(const Entry* const (&from)[N], const pack<N>& place, const Entry* (&to)[N]) {
    using vector = typename pack<N>::bit_vector;
    constexpr double offset = 0x1p52;
    constexpr double size = sizeof(Entry);
    const vector distance = vector(fma(place, size, offset).v) - vector(pack<N>(offset).v);
    if constexpr (sizeof(vector) == sizeof from) {
        vector first;
        __builtin_memcpy(&first, from, sizeof first);
        const vector sum = first + distance;
        __builtin_memcpy(to, &sum, sizeof sum);
    } else {
        for (int i = 0; i < N; ++i)
            to[i] = reinterpret_cast<const Entry*>(reinterpret_cast<const char*>(from[i]) +
                                                   static_cast<long>(distance[i]));
    }
}

// As math.hpp says, in one instruction where there is one.
template <int N>
pack<N> only(const pack_mask<N>& m, const pack<N>& x) {
#if defined(__AVX512F__)
    if constexpr (N == 8)
        return pack<N>(_mm512_maskz_mov_pd(m.v, x.v));
    else
#endif
        return pack<N>::from_bits(typename pack<N>::bit_vector(x.v) &
                                  typename pack<N>::bit_vector(m.v));
}
template <int N>
pack<N> plus_where(const pack_mask<N>& m, const pack<N>& x, const pack<N>& y) {
#if defined(__AVX512F__)
    if constexpr (N == 8) return pack<N>(_mm512_mask_add_pd(x.v, m.v, x.v, y.v));
#endif
    return x + only(m, y);
}
template <int N>
pack<N> min(const pack<N>& a, const pack<N>& b) {
#if defined(__AVX__)
    if constexpr (N == 4) return pack<N>(_mm256_min_pd(b.v, a.v));
#endif
#if defined(__AVX512F__)
    if constexpr (N == 8) return pack<N>(_mm512_min_pd(b.v, a.v));
#endif
    return select(b < a, b, a);
}
template <int N>
pack<N> max(const pack<N>& a, const pack<N>& b) {
#if defined(__AVX__)
    if constexpr (N == 4) return pack<N>(_mm256_max_pd(b.v, a.v));
#endif
#if defined(__AVX512F__)
    if constexpr (N == 8) return pack<N>(_mm512_max_pd(b.v, a.v));
#endif
    return select(b > a, b, a);
}

// Two numbers from each lane's own place: lane i of `first` is from[i][0], of `second` from[i][1].
template <int N>
VI_HOT void zip_pairs(const double* const (&from)[N], pack<N>& first, pack<N>& second) {
    typedef double pair __attribute__((vector_size(16)));
    pair of[N];
    for (int i = 0; i < N; ++i)
        __builtin_memcpy(&of[i], from[i], sizeof of[i]);
    if constexpr (N == 2) {
        first.v = __builtin_shufflevector(of[0], of[1], 0, 2);
        second.v = __builtin_shufflevector(of[0], of[1], 1, 3);
    } else if constexpr (N == 4) { // even lanes in one register, odd lanes in another
        const auto even = __builtin_shufflevector(of[0], of[2], 0, 1, 2, 3);
        const auto odd = __builtin_shufflevector(of[1], of[3], 0, 1, 2, 3);
        first.v = __builtin_shufflevector(even, odd, 0, 4, 2, 6);
        second.v = __builtin_shufflevector(even, odd, 1, 5, 3, 7);
    } else {
        const auto join = [](pair a, pair b, pair c, pair d) {
            return __builtin_shufflevector(__builtin_shufflevector(a, b, 0, 1, 2, 3),
                                           __builtin_shufflevector(c, d, 0, 1, 2, 3), 0, 1, 2, 3, 4,
                                           5, 6, 7);
        };
        const auto even = join(of[0], of[2], of[4], of[6]), odd = join(of[1], of[3], of[5], of[7]);
        first.v = __builtin_shufflevector(even, odd, 0, 8, 2, 10, 4, 12, 6, 14);
        second.v = __builtin_shufflevector(even, odd, 1, 9, 3, 11, 5, 13, 7, 15);
    }
}

// Four numbers of each lane, in two pairs. Eight lanes are read in half the loads: rows of two lanes fill a register.
template <int N>
VI_HOT void zip_fours(const double* const (&from)[N], pack<N>& first, pack<N>& second,
                      pack<N>& third, pack<N>& fourth) {
    if constexpr (N == 8) {
        typedef double four __attribute__((vector_size(32)));
        const auto join = [&](int i, int j) {
            four a, b;
            __builtin_memcpy(&a, from[i], sizeof a);
            __builtin_memcpy(&b, from[j], sizeof b);
            return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
        };
        const auto a = join(0, 2), b = join(1, 3), c = join(4, 6), d = join(5, 7);
        const auto put = [](pack<N>& near, pack<N>& far, const auto& low, const auto& high) {
            near.v = __builtin_shufflevector(low, high, 0, 1, 4, 5, 8, 9, 12, 13);
            far.v = __builtin_shufflevector(low, high, 2, 3, 6, 7, 10, 11, 14, 15);
        };
        put(first, third, __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14),
            __builtin_shufflevector(c, d, 0, 8, 2, 10, 4, 12, 6, 14));
        put(second, fourth, __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15),
            __builtin_shufflevector(c, d, 1, 9, 3, 11, 5, 13, 7, 15));
    } else {
        const double* next[N];
        for (int i = 0; i < N; ++i)
            next[i] = from[i] + 2;
        zip_pairs(from, first, second);
        zip_pairs(next, third, fourth);
    }
}

static_assert(Real<pack<2>> && Real<pack<4>> && Real<pack<8>>);

} // namespace vi
