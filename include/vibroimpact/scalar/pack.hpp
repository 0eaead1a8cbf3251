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

#include "vibroimpact/scalar/concepts.hpp"

namespace vi {

// One truth value per lane, all bits of it set or none.
template <int N>
struct pack_mask {
    typedef long long vector __attribute__((vector_size(8 * N)));
    vector v;

    pack_mask() : v{} {}
    explicit pack_mask(bool b) : v(vector{} - static_cast<long long>(b)) {}
    explicit pack_mask(const vector& lanes) : v(lanes) {}

    friend pack_mask operator&(const pack_mask& a, const pack_mask& b) {
        return pack_mask(a.v & b.v);
    }
    friend pack_mask operator|(const pack_mask& a, const pack_mask& b) {
        return pack_mask(a.v | b.v);
    }
    friend pack_mask operator!(const pack_mask& a) { return pack_mask(~a.v); }
    pack_mask& operator&=(const pack_mask& b) { return *this = *this & b; }
    pack_mask& operator|=(const pack_mask& b) { return *this = *this | b; }
};

template <int N>
bool any(const pack_mask<N>& mask) {
    long long joined = 0;
    for (int i = 0; i < N; ++i)
        joined |= mask.v[i];
    return joined != 0;
}

template <int N>
bool all(const pack_mask<N>& mask) {
    return !any(!mask);
}

template <int N>
bool lane(const pack_mask<N>& mask, int i) {
    return mask.v[i] != 0;
}

template <int N>
void set_lane(pack_mask<N>& mask, int i, bool s) {
    mask.v[i] = -static_cast<long long>(s);
}

template <int N>
struct pack {
    static_assert(N == 2 || N == 4 || N == 8);
    typedef double vector __attribute__((vector_size(8 * N)));
    typedef unsigned long long bit_vector __attribute__((vector_size(8 * N)));
    using mask = pack_mask<N>;
    vector v;

    pack() : v{} {}
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

    friend mask operator<(const pack& a, const pack& b) { return mask(a.v < b.v); }
    friend mask operator<=(const pack& a, const pack& b) { return mask(a.v <= b.v); }
    friend mask operator>(const pack& a, const pack& b) { return mask(a.v > b.v); }
    friend mask operator>=(const pack& a, const pack& b) { return mask(a.v >= b.v); }
    friend mask operator==(const pack& a, const pack& b) { return mask(a.v == b.v); }
    friend mask operator!=(const pack& a, const pack& b) { return mask(a.v != b.v); }

    friend pack select(const mask& m, const pack& a, const pack& b) {
        return pack(m.v ? a.v : b.v);
    }
};

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

template <int N>
double lane(const pack<N>& x, int i) {
    return x.v[i];
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

static_assert(Real<pack<2>> && Real<pack<4>> && Real<pack<8>>);

} // namespace vi
