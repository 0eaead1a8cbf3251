// Marching by recurrence without drift.
//
// Method      y_{n+1} = exp(B step) y_n. After 32 steps the state is taken anew by one step 32 times
//             as long, and after 32 of those by one 1024 times as long, so at most
//             31 + 31 + n / 1024 applications lie between a state and the start of its flight.
//             Longer leaps are by squares of that last step, and count as often as it is in them.
// Accuracy    each application adds at most 4 ulp of the amplitude; applications() counts them
#pragma once

#include "vibroimpact/flow/modal.hpp"

namespace vi {

VI_HD constexpr double two_to(int n) {
    double power = 1.0;
    for (; n > 0; --n)
        power = power + power;
    return power;
}

template <class T, class Flow>
struct ladder {
    using state = typename Flow::template state<T>;
    state y, tens, hundreds; // after 1, 32 and 1024 steps
    int ones_ = 0, tens_ = 0;
    double hundreds_ = 0.0;
    double before_ = 0.0, applied_ = 0.0; // steps and applications before the last stride ended

    VI_HD explicit ladder(const state& start) : y(start), tens(start), hundreds(start) {}

    VI_HD void advance(const Flow& flow) {
        if (++ones_ < rung)
            y = flow.apply(flow.once, y);
        else
            leap(flow);
    }
    // To the end of a rung that begins here, or has been marched through.
    VI_HD void leap(const Flow& flow) {
        ones_ = 0;
        if (++tens_ == rung) return leap_far(flow);
        tens = flow.apply(flow.rungs[0], tens);
        y = tens;
    }
    VI_HD void leap_far(const Flow& flow) {
        tens_ = 0;
        ++hundreds_;
        hundreds = flow.apply(flow.rungs[1], hundreds);
        tens = hundreds;
        y = tens;
    }
    // As often doubled.
    VI_HD void leap_farther(const Flow& flow, int doublings) {
        hundreds_ = hundreds_ + two_to(doublings);
        y = tens = hundreds = flow.apply(flow.squared(flow.rungs[1], doublings), hundreds);
    }
    // To a state so many steps from here, by one application: it begins anew there.
    VI_HD void stride(const state& to, double steps_on) {
        const double passed = steps() + steps_on, applied = applications() + 1.0;
        *this = ladder(to);
        before_ = passed;
        applied_ = applied;
    }
    // So many steps may be leapt from here, though not where the flight starts.
    VI_HD int leap_ahead() const { return ones_ > 0 || steps() == 0.0 ? 0 : rung; }
    VI_HD int far_leap_ahead() const { return tens_ > 0 ? 0 : rung * leap_ahead(); }

    VI_HD double steps() const { return before_ + (ones_ + rung * (tens_ + rung * hundreds_)); }
    VI_HD double applications() const { return applied_ + (ones_ + tens_ + hundreds_); }
};

} // namespace vi
