// Exact derivatives by carrying them along.
//
// A jet is a number with its first derivatives: x = v + d[0] e_0 + ... + d[N-1] e_{N-1}, where the
// e_i are infinitely small, so that every product e_i e_j is dropped. Arithmetic on such sums is
// arithmetic on functions and their gradients at once; for a product,
//
//     (v + d.e)(w + f.e) = v w + (v f + w d).e
//
// is the product rule, and f(v + d.e) = f(v) + f'(v) d.e is the chain rule. Write an algorithm for
// a scalar T, run it with T = jet, and out comes its value together with its gradient, free of the
// cancellation that differences suffer from. To differentiate with respect to x and y:
//
//     using J = jet<double, 2>;
//     J x = J::variable(3.0, 0), y = J::variable(0.5, 1);
//     J r = sqrt(x * x + y * y);     // r.v = |(x, y)|, r.d[0] = x / r.v, r.d[1] = y / r.v
//
// N is the number of directions, not of variables: to push one direction w through, use N = 1 and
// set d[0] of each variable to its component of w. R may be a pack, and each lane has its own
// gradient.
//
// Three rules to know:
//  - A comparison looks at the value alone. A jet follows the branch its value takes and gives that
//    branch's derivative; where branches meet with different slopes, the derivative is one-sided.
//  - The value is computed by exactly the operations that R alone would do: same bits with or
//  without
//    derivatives.
//  - An iteration that stops when the *value* has converged may leave derivatives behind. After a
//    root search of f(t) = 0, take the derivatives of t from the implicit function theorem:
//    t.d = -f.d / f', which is one more Newton step in jets from a value that is already exact.
//
// sqrt at 0 and abs at 0 have no derivative: sqrt gives infinities or NaN, abs that of +x.
#pragma once

#include "vibroimpact/numeric/concepts.hpp"
#include "vibroimpact/numeric/math.hpp"

namespace vi {

template <class R, int N>
struct jet {
    static_assert(N >= 1);
    R v{};
    R d[N]{};

    jet() = default;
    VI_HD jet(double x) : v(x) {}
    VI_HD explicit jet(const R& x)
        requires(!is_same<R, double>)
        : v(x) {}

    // The i-th independent variable: its derivative in direction i is 1.
    VI_HD static jet variable(const R& x, int i) {
        jet result;
        result.v = x;
        result.d[i] = R(1.0);
        return result;
    }
};

template <class R, int N>
struct scalar_traits<jet<R, N>> {
    using real = R;
    using mask = mask_t<R>;
    using lane = jet<lane_t<R>, N>;
    static constexpr int lanes = scalar_traits<R>::lanes;
    static constexpr bool is_jet = true;
};

// Constants beside a jet: a number, or a value of its real type.
template <class S, class R>
concept JetConstant = is_same<S, double> || is_same<S, int> || is_same<S, R>;

namespace detail {

// Chain rule: the function value is `v`, its derivative at x.v is `slope`.
template <class R, int N>
VI_HD jet<R, N> chain(const R& v, const R& slope, const jet<R, N>& x) {
    jet<R, N> y;
    y.v = v;
    for (int i = 0; i < N; ++i)
        y.d[i] = slope * x.d[i];
    return y;
}

} // namespace detail

// Access -----------------------------------------------------------------------------------------

template <class R, int N>
VI_HD R value(const jet<R, N>& x) {
    return x.v;
}
template <int N>
VI_HD double plain(const jet<double, N>& x) {
    return x.v;
}

template <class R, int N>
VI_HD lane_t<jet<R, N>> lane(const jet<R, N>& x, int i) {
    lane_t<jet<R, N>> s;
    s.v = lane(x.v, i);
    for (int k = 0; k < N; ++k)
        s.d[k] = lane(x.d[k], i);
    return s;
}

template <class R, int N>
VI_HD void set_lane(jet<R, N>& x, int i, const lane_t<jet<R, N>>& s) {
    set_lane(x.v, i, s.v);
    for (int k = 0; k < N; ++k)
        set_lane(x.d[k], i, s.d[k]);
}

template <class R, int N>
VI_HD jet<R, N> select(const mask_t<R>& mask, const jet<R, N>& a, const jet<R, N>& b) {
    jet<R, N> y;
    y.v = select(mask, a.v, b.v);
    for (int i = 0; i < N; ++i)
        y.d[i] = select(mask, a.d[i], b.d[i]);
    return y;
}

// Jet with jet -----------------------------------------------------------------------------------

template <class R, int N>
VI_HD jet<R, N> operator+(const jet<R, N>& a, const jet<R, N>& b) {
    jet<R, N> y;
    y.v = a.v + b.v;
    for (int i = 0; i < N; ++i)
        y.d[i] = a.d[i] + b.d[i];
    return y;
}

template <class R, int N>
VI_HD jet<R, N> operator-(const jet<R, N>& a, const jet<R, N>& b) {
    jet<R, N> y;
    y.v = a.v - b.v;
    for (int i = 0; i < N; ++i)
        y.d[i] = a.d[i] - b.d[i];
    return y;
}

template <class R, int N>
VI_HD jet<R, N> operator*(const jet<R, N>& a, const jet<R, N>& b) {
    jet<R, N> y;
    y.v = a.v * b.v;
    for (int i = 0; i < N; ++i)
        y.d[i] = a.v * b.d[i] + b.v * a.d[i];
    return y;
}

template <class R, int N>
VI_HD jet<R, N> operator/(const jet<R, N>& a, const jet<R, N>& b) {
    jet<R, N> y;
    y.v = a.v / b.v;
    const R inverse = 1.0 / b.v;
    for (int i = 0; i < N; ++i)
        y.d[i] = (a.d[i] - y.v * b.d[i]) * inverse;
    return y;
}

template <class R, int N>
VI_HD jet<R, N> operator-(const jet<R, N>& a) {
    jet<R, N> y;
    y.v = -a.v;
    for (int i = 0; i < N; ++i)
        y.d[i] = -a.d[i];
    return y;
}

// Jet with constant ------------------------------------------------------------------------------

template <class R, int N, JetConstant<R> S>
VI_HD jet<R, N> operator+(const jet<R, N>& a, const S& b) {
    jet<R, N> y = a;
    y.v = a.v + b;
    return y;
}

template <class R, int N, JetConstant<R> S>
VI_HD jet<R, N> operator-(const jet<R, N>& a, const S& b) {
    jet<R, N> y = a;
    y.v = a.v - b;
    return y;
}

template <class R, int N, JetConstant<R> S>
VI_HD jet<R, N> operator*(const jet<R, N>& a, const S& b) {
    jet<R, N> y;
    y.v = a.v * b;
    for (int i = 0; i < N; ++i)
        y.d[i] = a.d[i] * b;
    return y;
}

template <class R, int N, JetConstant<R> S>
VI_HD jet<R, N> operator/(const jet<R, N>& a, const S& b) {
    jet<R, N> y;
    y.v = a.v / b;
    for (int i = 0; i < N; ++i)
        y.d[i] = a.d[i] / b;
    return y;
}

template <class R, int N, JetConstant<R> S>
VI_HD jet<R, N> operator+(const S& a, const jet<R, N>& b) {
    return b + a;
}

template <class R, int N, JetConstant<R> S>
VI_HD jet<R, N> operator-(const S& a, const jet<R, N>& b) {
    jet<R, N> y = -b;
    y.v = a - b.v; // and not -(b - a), which differs in the sign of zero
    return y;
}

template <class R, int N, JetConstant<R> S>
VI_HD jet<R, N> operator*(const S& a, const jet<R, N>& b) {
    return b * a;
}

template <class R, int N, JetConstant<R> S>
VI_HD jet<R, N> operator/(const S& a, const jet<R, N>& b) {
    const R v = a / b.v;
    return detail::chain<R, N>(v, -v / b.v, b);
}

template <class R, int N, class S>
VI_HD jet<R, N>& operator+=(jet<R, N>& a, const S& b) {
    return a = a + b;
}
template <class R, int N, class S>
VI_HD jet<R, N>& operator-=(jet<R, N>& a, const S& b) {
    return a = a - b;
}
template <class R, int N, class S>
VI_HD jet<R, N>& operator*=(jet<R, N>& a, const S& b) {
    return a = a * b;
}
template <class R, int N, class S>
VI_HD jet<R, N>& operator/=(jet<R, N>& a, const S& b) {
    return a = a / b;
}

// a b + c: the value with one rounding, each derivative a db + (b da + dc).
namespace detail {
template <class T>
inline constexpr bool is_first_order = false;
template <class R, int N>
inline constexpr bool is_first_order<jet<R, N>> = true;

template <class R, class T>
VI_HD constexpr auto& value_of(const T& x) {
    if constexpr (is_first_order<T>)
        return x.v;
    else
        return x;
}
} // namespace detail

template <class A, class B, class C>
    requires(detail::is_first_order<A> || detail::is_first_order<B> || detail::is_first_order<C>)
VI_HOT auto fma(const A& a, const B& b, const C& c) {
    using detail::is_first_order, detail::value_of;
    decltype(a * b + c) y;
    using R = decltype(y.v);
    const R u = value_of<R>(a), v = value_of<R>(b);
    y.v = fma(u, v, R(value_of<R>(c)));
    for (int i = 0; i < static_cast<int>(sizeof y.d / sizeof(R)); ++i) {
        R d = R(0.0);
        if constexpr (is_first_order<C>) d = c.d[i];
        if constexpr (is_first_order<A>) d = fma(v, a.d[i], d);
        if constexpr (is_first_order<B>) d = fma(u, b.d[i], d);
        y.d[i] = d;
    }
    return y;
}

template <class A, class B, class C>
    requires(detail::is_first_order<A> || detail::is_first_order<B> || detail::is_first_order<C>)
VI_HD auto fnma(const A& a, const B& b, const C& c) {
    return fma(-a, b, c);
}

// Comparisons look at values ---------------------------------------------------------------------

#define VI_JET_COMPARISON(op)                                                                      \
    template <class R, int N>                                                                      \
    VI_HD mask_t<R> operator op(const jet<R, N>& a, const jet<R, N>& b) {                          \
        return a.v op b.v;                                                                         \
    }                                                                                              \
    template <class R, int N, JetConstant<R> S>                                                    \
    VI_HD mask_t<R> operator op(const jet<R, N>& a, const S& b) {                                  \
        return a.v op b;                                                                           \
    }                                                                                              \
    template <class R, int N, JetConstant<R> S>                                                    \
    VI_HD mask_t<R> operator op(const S& a, const jet<R, N>& b) {                                  \
        return a op b.v;                                                                           \
    }
VI_JET_COMPARISON(<)
VI_JET_COMPARISON(<=)
VI_JET_COMPARISON(>)
VI_JET_COMPARISON(>=)
VI_JET_COMPARISON(==)
VI_JET_COMPARISON(!=)
#undef VI_JET_COMPARISON

// Elementary functions ---------------------------------------------------------------------------

template <class R, int N>
VI_HD jet<R, N> sqrt(const jet<R, N>& x) {
    const R v = sqrt(x.v);
    return detail::chain<R, N>(v, 0.5 / v, x);
}

template <class R, int N>
VI_HD sine_cosine<jet<R, N>> sincos(const jet<R, N>& x) {
    const sine_cosine<R> f = sincos(x.v);
    return {detail::chain<R, N>(f.s, f.c, x), detail::chain<R, N>(f.c, -f.s, x)};
}

template <class R, int N>
VI_HD jet<R, N> exp(const jet<R, N>& x) {
    const R v = exp(x.v);
    return detail::chain<R, N>(v, v, x);
}

template <class R, int N>
VI_HD jet<R, N> log(const jet<R, N>& x) {
    return detail::chain<R, N>(log(x.v), 1.0 / x.v, x);
}

// d atan2(y, x) = (x dy - y dx) / (x^2 + y^2)
template <class R, int N>
VI_HD jet<R, N> atan2(const jet<R, N>& y, const jet<R, N>& x) {
    const R inverse = 1.0 / (x.v * x.v + y.v * y.v);
    jet<R, N> angle;
    angle.v = atan2(y.v, x.v);
    for (int i = 0; i < N; ++i)
        angle.d[i] = (x.v * y.d[i] - y.v * x.d[i]) * inverse;
    return angle;
}

static_assert(Scalar<jet<double, 3>>);

} // namespace vi
