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

#include "vibroimpact/math.hpp"

namespace vi {

// C, S, S' and I at one time.
struct fundamental {
    double c, s, ds, i;
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

// First `b`, then `a`.
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

// (a): S = sum s_n t^n with (n+2)(n+1) s_{n+2} = -c (n+1) s_{n+1} - k s_n; terms fall like 1/n!, and
// faster than by halves from the fourth on: where two are below 2^-60 of the first, so is the rest.
VI_HD inline fundamental by_series(double k, double c, double t) {
    double before = 0.0, term = t; // s_{n-1} t^(n-1), s_n t^n
    double s = term, ds = 1.0, i = t * t / 2.0;
    for (int n = 1; n < 32; ++n) {
        const double next = (-(c * t) * n * term - k * (t * t) * before) / (n * (n + 1.0));
        before = term;
        term = next;
        s = s + term;
        ds = ds + term * (n + 1.0) / t;
        i = i + term * t / (n + 2.0);
        if (n > 4 && abs(term) + abs(before) < 0x1p-60 * t) break;
    }
    return {ds + c * s, s, ds, i};
}

// (b): S = exp(-c t/2) t sinhc(D t^2), S' + (c/2) S = exp(-c t/2) cosh(sqrt(D) t), D t^2 < 1/2.
VI_HD inline fundamental by_discriminant(double k, double c, double t, double d) {
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
VI_HD inline fundamental by_exponents(double k, double c, double t, double d) {
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

VI_HD inline fundamental fundamental_solutions(double k, double c, double t) {
    if (t == 0.0) return {1.0, 0.0, 1.0, 0.0};
    if (abs(k) * t * t <= 1.0 && abs(c) * t <= 2.0) return detail::by_series(k, c, t);
    const double d = c * c / 4.0 - k;
    return d * t * t < 0.5 ? detail::by_discriminant(k, c, t, d) : detail::by_exponents(k, c, t, d);
}

VI_CALL block_step<double> propagate(double k, double c, double a, double t) {
    const fundamental f = fundamental_solutions(k, c, t);
    return {f.c, f.s, f.i * a, -k * f.s, f.ds, f.s * a};
}

} // namespace vi
