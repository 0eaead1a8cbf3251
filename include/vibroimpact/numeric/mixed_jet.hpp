// Higher derivatives, one per direction.
//
// A mixed jet is a polynomial in infinitely small e_1, ..., e_K whose squares vanish, e_i^2 = 0:
//
//     x = sum over subsets S of {1, .., K} of  c[S] e_S,     e_S the product of its e_i,
//
// with S written as a bit mask. Let x_j = z_j + u_j e_1 + v_j e_2 + w_j e_3 for all variables j; then
//
//     f(x) = f + D f[u] e_1 + D f[v] e_2 + D^2 f[u, v] e_1 e_2 + ... + D^3 f[u, v, w] e_1 e_2 e_3,
//
// every multilinear form in the directions seeded and in no other. With u = v = w along one
// parameter the coefficients are f', f'', f'''. A product costs 3^K multiplications.
//
// The rules of jet.hpp hold: comparisons look at values, values have the bits of a run without
// derivatives, and an equation solved for its value is solved for its derivatives by Newton steps,
// each of which here doubles the order that is right.
#pragma once

#include "vibroimpact/numeric/concepts.hpp"
#include "vibroimpact/numeric/math.hpp"

namespace vi {

template <int K>
struct mixed_jet {
    static_assert(K >= 1 && K <= 5);
    static constexpr int order = K;
    static constexpr int size = 1 << K;
    double c[size]{};

    mixed_jet() = default;
    VI_HD mixed_jet(double x) { c[0] = x; }

    // The i-th direction alone: e_i.
    VI_HD static mixed_jet direction(int i) {
        mixed_jet e;
        e.c[1 << i] = 1.0;
        return e;
    }
};

template <int K>
struct scalar_traits<mixed_jet<K>> {
    using real = double;
    using mask = bool;
    using lane = mixed_jet<K>;
    static constexpr int lanes = 1;
    static constexpr bool is_jet = true;
};

template <int K>
VI_HD double value(const mixed_jet<K>& x) {
    return x.c[0];
}
template <int K>
VI_HD double plain(const mixed_jet<K>& x) {
    return x.c[0];
}
template <int K>
VI_HD mixed_jet<K> lane(const mixed_jet<K>& x, int) {
    return x;
}
template <int K>
VI_HD void set_lane(mixed_jet<K>& x, int, const mixed_jet<K>& s) {
    x = s;
}
template <int K>
VI_HD mixed_jet<K> select(bool mask, const mixed_jet<K>& a, const mixed_jet<K>& b) {
    return mask ? a : b;
}

// Arithmetic -------------------------------------------------------------------------------------

template <int K>
VI_HD mixed_jet<K> operator+(mixed_jet<K> a, const mixed_jet<K>& b) {
    for (int s = 0; s < a.size; ++s)
        a.c[s] = a.c[s] + b.c[s];
    return a;
}
template <int K>
VI_HD mixed_jet<K> operator-(mixed_jet<K> a, const mixed_jet<K>& b) {
    for (int s = 0; s < a.size; ++s)
        a.c[s] = a.c[s] - b.c[s];
    return a;
}
template <int K>
VI_HD mixed_jet<K> operator-(mixed_jet<K> a) {
    for (double& c : a.c)
        c = -c;
    return a;
}

// Over the ways of sharing S between the factors: T a part of S, the rest S \ T = S ^ T.
template <int K>
VI_HD mixed_jet<K> operator*(const mixed_jet<K>& a, const mixed_jet<K>& b) {
    mixed_jet<K> y;
    for (int s = 0; s < y.size; ++s) {
        double sum = a.c[s] * b.c[0];
        for (int t = s; t > 0;) {
            t = (t - 1) & s;
            sum = sum + a.c[t] * b.c[s ^ t];
        }
        y.c[s] = sum;
    }
    return y;
}

namespace detail {

// f(x) by its Taylor series at the value of x, which ends: (x - value)^(K + 1) = 0.
template <int K>
VI_HD mixed_jet<K> compose(const mixed_jet<K>& x, const double (&derivatives)[K + 1]) {
    mixed_jet<K> small = x;
    small.c[0] = 0.0;
    mixed_jet<K> sum(derivatives[K]);
    for (int k = K - 1; k >= 0; --k) {
        sum = sum * small * (1.0 / (k + 1));
        sum.c[0] = derivatives[k];
    }
    return sum;
}

// x^a, given its value: the derivatives are a (a - 1) ... (a - k + 1) x^(a - k).
template <int K>
VI_HD mixed_jet<K> power_with_value(const mixed_jet<K>& x, double a, double at) {
    double d[K + 1];
    d[0] = at;
    for (int k = 1; k <= K; ++k)
        d[k] = d[k - 1] * (a - (k - 1)) / x.c[0];
    return compose<K>(x, d);
}

} // namespace detail

template <int K>
VI_HD mixed_jet<K> operator*(mixed_jet<K> a, double b) {
    for (double& c : a.c)
        c = c * b;
    return a;
}
template <int K>
VI_HD mixed_jet<K> operator*(double a, const mixed_jet<K>& b) {
    return b * a;
}
template <int K>
VI_HD mixed_jet<K> operator+(mixed_jet<K> a, double b) {
    a.c[0] = a.c[0] + b;
    return a;
}
template <int K>
VI_HD mixed_jet<K> operator+(double a, const mixed_jet<K>& b) {
    return b + a;
}
template <int K>
VI_HD mixed_jet<K> operator-(mixed_jet<K> a, double b) {
    a.c[0] = a.c[0] - b;
    return a;
}
template <int K>
VI_HD mixed_jet<K> operator-(double a, const mixed_jet<K>& b) {
    mixed_jet<K> y = -b;
    y.c[0] = a - b.c[0];
    return y;
}
template <int K>
VI_HD mixed_jet<K> operator/(const mixed_jet<K>& a, const mixed_jet<K>& b) {
    mixed_jet<K> y = a * detail::power_with_value(b, -1.0, 1.0 / b.c[0]);
    y.c[0] = a.c[0] / b.c[0];
    return y;
}
template <int K>
VI_HD mixed_jet<K> operator/(mixed_jet<K> a, double b) {
    for (double& c : a.c)
        c = c / b;
    return a;
}
template <int K>
VI_HD mixed_jet<K> operator/(double a, const mixed_jet<K>& b) {
    return mixed_jet<K>(a) / b;
}

// a b + c, the value with one rounding.
namespace detail {
template <class T>
inline constexpr bool is_mixed = false;
template <int K>
inline constexpr bool is_mixed<mixed_jet<K>> = true;
} // namespace detail

template <class A, class B, class C>
    requires(detail::is_mixed<A> || detail::is_mixed<B> || detail::is_mixed<C>)
VI_HD auto fma(const A& a, const B& b, const C& c) {
    decltype(a * b + c) y = a * b + c;
    y.c[0] = fma(value(a), value(b), value(c));
    return y;
}

template <class A, class B, class C>
    requires(detail::is_mixed<A> || detail::is_mixed<B> || detail::is_mixed<C>)
VI_HD auto fnma(const A& a, const B& b, const C& c) {
    return fma(-a, b, c);
}

// Comparisons look at values ---------------------------------------------------------------------

#define VI_MIXED_COMPARISON(op)                                                                    \
    template <int K>                                                                               \
    VI_HD bool operator op(const mixed_jet<K>& a, const mixed_jet<K>& b) {                         \
        return a.c[0] op b.c[0];                                                                   \
    }                                                                                              \
    template <int K>                                                                               \
    VI_HD bool operator op(const mixed_jet<K>& a, double b) {                                      \
        return a.c[0] op b;                                                                        \
    }                                                                                              \
    template <int K>                                                                               \
    VI_HD bool operator op(double a, const mixed_jet<K>& b) {                                      \
        return a op b.c[0];                                                                        \
    }
VI_MIXED_COMPARISON(<)
VI_MIXED_COMPARISON(<=)
VI_MIXED_COMPARISON(>)
VI_MIXED_COMPARISON(>=)
VI_MIXED_COMPARISON(==)
VI_MIXED_COMPARISON(!=)
#undef VI_MIXED_COMPARISON

// Elementary functions ---------------------------------------------------------------------------

template <int K>
VI_HD mixed_jet<K> sqrt(const mixed_jet<K>& x) {
    return detail::power_with_value(x, 0.5, sqrt(x.c[0]));
}

template <int K>
VI_HD sine_cosine<mixed_jet<K>> sincos(const mixed_jet<K>& x) {
    const auto at = sincos(x.c[0]);
    const double turn[4] = {at.s, at.c, -at.s, -at.c}; // sin and its derivatives
    double s[K + 1], c[K + 1];
    for (int k = 0; k <= K; ++k) {
        s[k] = turn[k % 4];
        c[k] = turn[(k + 1) % 4];
    }
    return {detail::compose<K>(x, s), detail::compose<K>(x, c)};
}

template <int K>
VI_HD mixed_jet<K> exp(const mixed_jet<K>& x) {
    double d[K + 1];
    d[0] = exp(x.c[0]);
    for (int k = 1; k <= K; ++k)
        d[k] = d[0];
    return detail::compose<K>(x, d);
}

template <int K>
VI_HD mixed_jet<K> log(const mixed_jet<K>& x) {
    double d[K + 1];
    d[0] = log(x.c[0]);
    d[1] = 1.0 / x.c[0];
    for (int k = 2; k <= K; ++k)
        d[k] = -(k - 1) * d[k - 1] / x.c[0];
    return detail::compose<K>(x, d);
}

static_assert(Scalar<mixed_jet<3>>);

} // namespace vi
