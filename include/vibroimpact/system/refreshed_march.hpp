// Marching by recurrence without drift.
//
// Method      y_{n+1} = exp(B step) y_n. After 32 steps the state is taken anew by one step 32 times
//             as long, and after 32 of those by one 1024 times as long, so at most
//             31 + 31 + n / 1024 applications lie between a state and the start of its flight.
//             Longer leaps, by one step as long, count as often as that last one is in them.
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
struct refreshed_march {
    using state = typename Flow::template state<T>;
    state y, by_32, by_1024; // after 1, 32 and 1024 steps
    int single_ = 0, by_32_ = 0;
    double by_1024_ = 0.0;
    double before_ = 0.0, applied_ = 0.0; // steps and applications before the last stride ended

    VI_HD explicit refreshed_march(const state& start) : y(start), by_32(start), by_1024(start) {}

    VI_HD void advance(const Flow& flow) {
        if (++single_ < refresh_interval)
            y = flow.apply(flow.once, y);
        else
            leap(flow);
    }
    // To the end of the interval that begins here, or has been marched through.
    VI_HD void leap(const Flow& flow) {
        single_ = 0;
        if (++by_32_ == refresh_interval) return leap_far(flow);
        by_32 = flow.apply(flow.refresh[0], by_32);
        y = by_32;
    }
    VI_HD void leap_far(const Flow& flow) {
        by_32_ = 0;
        ++by_1024_;
        by_1024 = flow.apply(flow.refresh[1], by_1024);
        by_32 = by_1024;
        y = by_32;
    }
    // Leaps over a stretch that is doubled so often.
    VI_HD void leap_farther(const Flow& flow, int doublings) {
        by_1024_ = by_1024_ + two_to(doublings);
        const double steps = refresh_interval * refresh_interval * two_to(doublings);
        y = by_32 = by_1024 = flow.apply(flow.at_time(steps * flow.step), by_1024);
    }
    // To a state so many steps from here, by one application: it begins anew there.
    VI_HD void stride(const state& to, double steps_on) {
        const double passed = steps() + steps_on, applied = applications() + 1.0;
        *this = refreshed_march(to);
        before_ = passed;
        applied_ = applied;
    }
    // So many steps may be leapt from here, though not where the flight starts.
    VI_HD int leap_ahead() const { return single_ > 0 || steps() == 0.0 ? 0 : refresh_interval; }
    VI_HD int far_leap_ahead() const { return by_32_ > 0 ? 0 : refresh_interval * leap_ahead(); }

    VI_HD double steps() const {
        return before_ + (single_ + refresh_interval * (by_32_ + refresh_interval * by_1024_));
    }
    VI_HD double applications() const { return applied_ + (single_ + by_32_ + by_1024_); }
};

} // namespace vi
