// The impact of one contact: Newton's law of restitution.
//
// Method      A contact whose u arrives at the rate u' leaves at -R u'. The impulse against u that does
//             this, A being the mobility of the contact, moves y by a jump of rank one:
//               u'+ = -R u',   p = (1 + R) u' / A,   y+ = y - impulse p                      (1)
//             The same for gap rates, which are -side u'.
// Assumes     0 <= R <= 1; an impulse that moves u' by A
// Accuracy    exact but for three roundings; where R carries derivatives, so does the result
// Fails       nowhere
// Notation    T: double, a pack, a jet of either, a mixed jet; R, impulse and 1 / A may be of the
//             scalars of the system. All instances round alike: equal bits.
// Reference   theory.md, "Impact"
#pragma once

#include "vibroimpact/numeric/sizes.hpp"

namespace vi {

// (1): what the impulse takes from the rate, A p, and the rate after it.
template <class T>
struct rebound {
    T change, rate;
};
template <class T, class R>
VI_HOT constexpr rebound<T> rebound_of(const T& rate, const R& restitution) {
    return {(1.0 + restitution) * rate, -(restitution * rate)};
}

// (1) for one coordinate of y.
template <class T, class R>
VI_HOT constexpr void push(T& y, const R& impulse, const T& p) {
    y = fnma(impulse, p, y);
}

} // namespace vi
