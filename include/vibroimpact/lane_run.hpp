// Many runs, one per lane; a lane whose run has ended takes the next one.
//
// Method      What run.hpp does for one trajectory, for all lanes at once: clocks and counts are packs,
//             and an impact that nobody watches costs nothing beyond them. An event that is to be
//             seen, that ends a run, or that a certified step brought, is handled lane by lane.
//             The host lends runs and takes them back:
//               bool next(i, slot)      another run for lane i; false if there is none. Flights are
//                                       limited by slot.limit.t_max alone.
//               bool see(i, e, at, now) an event at or after slot.watch; false leaves the run
//               bool build(i, code)     the mode of a closed set that is missing; false if it cannot
//               void end(i, slot, why)  the run of lane i has ended
//               bool interrupted()      asked now and then; true ends all runs
// Accuracy    bits of run(): the same operations for each trajectory in the same order
#pragma once

#include "vibroimpact/lanes.hpp"
#include "vibroimpact/run.hpp"

namespace vi {

template <class Flow>
struct lane_slot {
    const hybrid<Flow>* system = nullptr;
    trajectory<double, typename Flow::shape_type> at;
    run_progress so_far{};
    limits limit{};
    double watch = 0.0; // events before this time are not shown
};

template <int N, class Flow, class Host>
class lane_run {
    using Shape = typename Flow::shape_type;
    using real = pack<N>;

public:
    explicit lane_run(Host& host) : host_(host) {}

    void run() {
        for (int i = 0; i < N; ++i) {
            systems_.free.flow.ahead.entry[i] = &nothing_; // read, and not used, in an idle lane
            load(i);
        }
        for (long round = 1; any(busy_); ++round) {
            if (round % between_questions == 0 && host_.interrupted()) return end_all();
            const real horizon = end_ - (high_ + low_);
            fly(systems_, all_, horizon, busy_, round_);
            count_landed();
            const auto attention = busy_ & (round_.stuck | (round_.end.landed & watched()));
            if (any(attention))
                for (int i = 0; i < N; ++i)
                    if (lane(attention, i)) attend(i, lane(horizon, i));
        }
    }

private:
    // Events that are not simply counted: shown to the host, or at a limit.
    pack_mask<N> watched() const {
        return (high_ + low_ >= watch_) | (impacts_ >= most_impacts_) | (events_ >= most_events_) |
               !(round_.end.duration > 0.0);
    }

    void count_landed() {
        const auto& landed = round_.end.landed;
        const real t = select(landed, round_.end.duration, real(0.0));
        const real sum = high_ + t, part = sum - high_; // clock::add
        low_ = low_ + ((high_ - (sum - part)) + (t - part));
        high_ = sum;
        const real one = select(landed, real(1.0), real(0.0));
        impacts_ = impacts_ + one;
        events_ = events_ + one;
    }

    void load(int i) {
        auto& slot = slots_[i];
        set_lane(busy_, i, host_.next(i, slot));
        if (!lane(busy_, i)) return;
        put_system(systems_, i, *slot.system);
        resume(i);
        set_lane(end_, i, slot.limit.t_max);
        set_lane(watch_, i, slot.watch);
        set_lane(most_impacts_, i, static_cast<double>(slot.limit.impacts));
        set_lane(most_events_, i, static_cast<double>(slot.limit.events));
    }

    // From the slot into the lane.
    void resume(int i) {
        const auto& slot = slots_[i];
        put_trajectory(all_, i, slot.at, slot.system->dimension(), slot.system->contacts());
        set_lane(high_, i, slot.so_far.now.high);
        set_lane(low_, i, slot.so_far.now.low);
        set_lane(impacts_, i, static_cast<double>(slot.so_far.impacts));
        set_lane(events_, i, static_cast<double>(slot.so_far.events));
    }

    // From the lane into the slot; a landed event is counted already.
    void suspend(int i) {
        auto& slot = slots_[i];
        const int n = slot.system->dimension(), contacts = slot.system->contacts();
        slot.at = take_trajectory(all_, i, n, contacts);
        slot.so_far.now = {lane(high_, i), lane(low_, i)};
        slot.so_far.impacts = static_cast<long>(lane(impacts_, i));
        const long events = static_cast<long>(lane(events_, i));
        if (events - lane(round_.end.landed, i) != slot.so_far.events) slot.so_far.at_once = 0;
        slot.so_far.events = events;
    }

    event<double, Shape> landed_event(int i) const {
        event<double, Shape> e{status::impact,
                               static_cast<int>(lane(round_.end.contact, i)),
                               static_cast<int>(lane(round_.end.side, i)),
                               0,
                               lane(round_.end.duration, i),
                               lane(round_.end.rate, i),
                               lane(round_.rate_after, i),
                               {}};
        for (int j = 0; j < slots_[i].system->dimension(); ++j)
            e.before[j] = lane(round_.before[j], i);
        return e;
    }

    // The event of one lane, as in run().
    void attend(int i, double left) {
        auto& slot = slots_[i];
        suspend(i);
        event<double, Shape> e;
        if (lane(round_.stuck, i)) {
            e = detail::go_on(*slot.system, slot.at, slot.at.y, lane(all_.flown, i), left);
            if (e.what == status::missing_mode) {
                if (e.code < 0 || !host_.build(i, e.code)) return finish(i, run_end::missing);
                return resume(i);
            }
            count(slot.so_far, e);
        } else {
            e = landed_event(i);
            slot.so_far.at_once = e.duration > 0.0 ? 0 : slot.so_far.at_once + 1;
        }
        const bool seen = slot.so_far.now.time() >= slot.watch;
        const bool go_on = !seen || host_.see(i, e, slot.at, slot.so_far.now);
        const run_end why = end_of_run(slot.so_far, e, slot.limit, left);
        if (why != run_end::none) return finish(i, why);
        if (!go_on) return finish(i, run_end::observer);
        if (slot.so_far.events >= slot.limit.events) return finish(i, run_end::events);
        if (lane(round_.stuck, i)) resume(i); // a landing is in the lane already
    }

    void finish(int i, run_end why) {
        host_.end(i, slots_[i], why);
        load(i);
    }

    void end_all() {
        for (int i = 0; i < N; ++i) {
            if (!lane(busy_, i)) continue;
            suspend(i);
            host_.end(i, slots_[i], run_end::interrupted);
        }
    }

    static constexpr typename Flow::stored nothing_{};

    Host& host_;
    lane_slot<Flow> slots_[N];
    lane_systems<N, Shape> systems_{};
    lane_states<N, Shape> all_{};
    lane_round<N, Shape> round_;
    real high_{}, low_{}, end_{}, watch_{}, impacts_{}, events_{}, most_impacts_{}, most_events_{};
    pack_mask<N> busy_{};
};

} // namespace vi
