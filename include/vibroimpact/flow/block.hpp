// The flight of one second-order block.
//
// Method      q'' = -k q - c q' + a has the solution                                      (theory T8)
//                 q(t)  =  C(t) q0 + S(t) q0' + I(t) a                                (1)
//                 q'(t) = -k S(t) q0 + (C(t) - c S(t)) q0' + S(t) a                   (2)
//             with S'' = -k S - c S', S(0) = 0, S'(0) = 1, C = S' + c S, I = integral of S.
//             All three are entire functions of k, c and t: critical damping and free masses
//             (k = 0) are ordinary points. S, C, I are computed
//               (a) from their Taylor series in t where |k| t^2 <= 1 and |c| t <= 2;
//               (b) by cos and sin, or a series in D t^2, D = c^2/4 - k, where D t^2 < 1/2;
//               (c) from the two real exponents elsewhere.
// Assumes     finite k, c, a; t >= 0. Rates beyond the range of sincos give NaN.
// Accuracy    a few ulp of max(|C q0|, |S q0'|, |I a|) for (k, c, t) perturbed by a few ulp
// Reference   theory.md, "Flight"
#pragma once

#include "vibroimpact/numeric/math.hpp"
#if !defined(__CUDACC__) && !defined(__CUDACC_RTC__)
#include "vibroimpact/numeric/pack.hpp"
#endif

namespace vi {

// C, S, S' and I at one time, of a pack at several.
template <class R>
struct fundamental {
    R c, s, ds, i;
};

// q(t) = qq q0 + qv v0 + qs,  v(t) = vq q0 + vv v0 + vs.
template <class R>
struct block_step {
    R qq, qv, qs, vq, vv, vs;
};

// Several blocks.
template <class R, int Blocks>
struct block_steps {
    block_step<R> block[Blocks];
};

// The step `b`, and after it `a`.
template <class R>
VI_HD constexpr block_step<R> after(const block_step<R>& a, const block_step<R>& b) {
    return {a.qq * b.qq + a.qv * b.vq, a.qq * b.qv + a.qv * b.vv, a.qq * b.qs + a.qv * b.vs + a.qs,
            a.vq * b.qq + a.vv * b.vq, a.vq * b.qv + a.vv * b.vv, a.vq * b.qs + a.vv * b.vs + a.vs};
}

// exp(x) - 1 without cancellation: the series where |x| < 1/2, 18 terms leave (1/2)^19 / 19! < 2^-75.
VI_HD constexpr double expm1_series(double x) {
    double sum = 1.0;
    for (int n = 18; n >= 2; --n)
        sum = 1.0 + x / n * sum;
    return x * sum;
}
VI_HD inline double exp_minus_one(double x) {
    return abs(x) < 0.5 ? expm1_series(x) : exp(x) - 1.0;
}

namespace detail {

VI_HD inline bool series_serve(double k, double c, double t) {
    return abs(k) * t * t <= 1.0 && abs(c) * t <= 2.0;
}

// (a): S = sum s_n t^n with (n+2)(n+1) s_{n+2} = -c (n+1) s_{n+1} - k s_n; terms fall like 1/n!, and
// faster than by halves from the fourth on: where two are below 2^-60 of the first, so is the rest.
template <class R>
VI_HD inline fundamental<R> by_series(const R& k, const R& c, const R& t) {
    R before = R(0.0), term = t; // s_{n-1} t^(n-1), s_n t^n
    R s = term, ds = R(1.0), i = t * t / 2.0;
    mask_t<R> open = R(0.0) == R(0.0);
    for (int n = 1; n < 32 && any(open); ++n) {
        const double m = n;
        const R next = (-(c * t) * m * term - k * (t * t) * before) / (m * (m + 1.0));
        before = term;
        term = next;
        s = select(open, s + term, s);
        ds = select(open, ds + term * (m + 1.0) / t, ds);
        i = select(open, i + term * t / (m + 2.0), i);
        if (n > 4) open = open & !(abs(term) + abs(before) < 0x1p-60 * t);
    }
    return {ds + c * s, s, ds, i};
}

// (b): S = exp(-c t/2) t sinhc(D t^2), S' + (c/2) S = exp(-c t/2) cosh(sqrt(D) t), D t^2 < 1/2.
VI_HD inline fundamental<double> by_discriminant(double k, double c, double t, double d) {
    const double decay = exp(-c * t / 2.0);
    double cosh = 1.0, sinhc = 1.0; // even parts: cos and sin(w t)/(w t) where D < 0
    if (d * t * t < -1.0) {
        const double w = sqrt(-d);
        const auto wave = sincos(w * t);
        cosh = wave.c;
        sinhc = wave.s / (w * t);
    } else {
        const double x = d * t * t;
        for (int n = 12; n >= 1; --n) {
            cosh = 1.0 + x / (2.0 * n * (2.0 * n - 1.0)) * cosh;
            sinhc = 1.0 + x / (2.0 * n * (2.0 * n + 1.0)) * sinhc;
        }
    }
    const double s = decay * t * sinhc;
    const double ds = decay * cosh - c / 2.0 * s;
    const double full = ds + c * s;
    return {full, s, ds, (1.0 - full) / k}; // here k t^2 > 1/2, so 1 - C hardly cancels
}

// (c): exponents r1 = -k / (c/2 + w) or -(c/2) + w, whichever does not cancel, and r2 alike.
VI_HD inline fundamental<double> by_exponents(double k, double c, double t, double d) {
    const double w = sqrt(d);
    const double big = c >= 0.0 ? -(c / 2.0 + w) : -(c / 2.0) + w;
    const double small = k / big;
    const double e_big = exp(big * t), e_small = exp(small * t);
    const double gap = small - big;
    const double s = (e_small - e_big) / gap;
    const double ds = (small * e_small - big * e_big) / gap;
    const double full = (small * e_big - big * e_small) / gap;
    const double i_small = small * t == 0.0 ? t : exp_minus_one(small * t) / small;
    const double i = (i_small - exp_minus_one(big * t) / big) / gap;
    return {full, s, ds, i};
}

} // namespace detail

VI_HD inline fundamental<double> fundamental_solutions(double k, double c, double t) {
    if (t == 0.0) return {1.0, 0.0, 1.0, 0.0};
    if (detail::series_serve(k, c, t)) return detail::by_series(k, c, t);
    const double d = c * c / 4.0 - k;
    return d * t * t < 0.5 ? detail::by_discriminant(k, c, t, d) : detail::by_exponents(k, c, t, d);
}

namespace detail {

VI_HD inline block_step<double> step_of(const fundamental<double>& f, double k, double a) {
    return {f.c, f.s, f.i * a, -k * f.s, f.ds, f.s * a};
}

} // namespace detail

VI_CALL block_step<double> propagate(double k, double c, double a, double t) {
    return detail::step_of(fundamental_solutions(k, c, t), k, a);
}

// At the times 0, part, 2 part, ...: with the bits of propagate(), most of them at once.
template <int Count>
VI_CALL void propagate_in_parts(double k, double c, double a, double part,
                                block_step<double> (&to)[Count]) {
    to[0] = propagate(k, c, a, 0.0);
    int next = 1;
#if !defined(__CUDACC__) && !defined(__CUDACC_RTC__)
    constexpr int N = native_lanes < 4 ? native_lanes : 4; // more would wait for the slowest
    for (; next + N <= Count && detail::series_serve(k, c, (next + N - 1) * part); next += N) {
        pack<N> t;
        for (int i = 0; i < N; ++i)
            set_lane(t, i, (next + i) * part);
        const auto f = detail::by_series<pack<N>>(k, c, t);
        for (int i = 0; i < N; ++i)
            to[next + i] =
                detail::step_of({lane(f.c, i), lane(f.s, i), lane(f.ds, i), lane(f.i, i)}, k, a);
    }
#endif
    for (; next < Count; ++next)
        to[next] = propagate(k, c, a, next * part);
}

} // namespace vi
