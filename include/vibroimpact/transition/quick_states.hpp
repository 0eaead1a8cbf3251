// The states that elements take, in many lanes at once, where that is beyond any doubt.
//
// Method      What elements.hpp decides, where a watch of one element has reached its limit, those of all
//             others are inside theirs, and every number that counts is either zero within the
//             rounding that is allowed there, or 2^17 times as large. The first derivative of a margin
//             that is zero has to be as large. Of the states of that element one can last then, and
//             the others cannot; but beside friction that sticks they may, where the law decides.
// Assumes     lanes in the same mode
// Fails       lanes that are not `sure`: elements.hpp decides
// Reference   theory.md, "Elements"
#pragma once

#include "vibroimpact/transition/elements.hpp"

namespace vi {

inline constexpr double beyond_doubt = 0x1p17; // roundings
inline constexpr double surely_zero = 0.99;

// A watch as the decision reads it: u, u', and the size of their terms, per largest |y_j| and in all.
template <class R, int D>
struct watch_view {
    vec<R, D> rows[2];
    R gains[2], sizes[2], adds[2];
    R lower, upper;
    int element;
    bool held, mapped; // mapped: y takes a map of its own where the limit is reached
};

namespace detail {

// Verdict of the values and rates of a watch: whether it lasts surely, or surely does not. `side` of a limit that the
// flight starts on, or 0, and the margin there.
template <class R>
struct watch_verdict {
    mask_t<R> lasts, fails;
    R side, offset;
};

template <class R, int D, class Flow>
VI_HOT watch_verdict<R> judge(const watch_view<R, D>& w, const Flow& flow, const vec<R, D>& y,
                              const R& largest) {
    watch_verdict<R> out{mask_t<R>(true), mask_t<R>(false), R(0.0), R(0.0)};
    const R u = flow.along(w.rows[0], y, w.gains[0]);
    const R rounding = tie_margin * fma(w.sizes[0], largest, w.adds[0]);
    if (w.held) {
        out.lasts = abs(u) <= (4.0 * surely_zero) * rounding;
        out.fails = abs(u) > beyond_doubt * rounding;
        return out;
    }
    const R speed = flow.along(w.rows[1], y, w.gains[1]);
    const R least = (beyond_doubt * tie_margin) * fma(w.sizes[1], largest, w.adds[1]);
    for (int side = -1; side <= 1; side += 2) {
        const R& limit = side > 0 ? w.upper : w.lower;
        const mask_t<R> there = abs(limit) < 0x1p1000;
        const R margin = side > 0 ? limit - u : u - limit;
        const R rate = side > 0 ? -speed : speed;
        const R around = fma(tie_margin, abs(limit), rounding);
        const mask_t<R> zero = there & (abs(margin) <= surely_zero * around);
        const mask_t<R> inside = !there | (margin > beyond_doubt * around);
        out.lasts = out.lasts & (inside | (zero & (rate > least)));
        out.fails =
            out.fails | (there & (margin < -(beyond_doubt * around))) | (zero & (rate < -least));
        out.side = select(zero, R(side), out.side);
        out.offset = select(zero, margin, out.offset);
    }
    return out;
}

} // namespace detail

} // namespace vi
