// Many runs, one per lane; a lane whose run has ended takes the next one.
//
// Method      What run.hpp does for one trajectory, for all lanes at once: clocks and counts are packs,
//             and an impact that nobody watches costs nothing beyond them. An event that is to be
//             seen, that ends a run, or that a certified step brought, is handled lane by lane.
//             Packs of lanes take turns at the stages of a round.
//             The host lends runs to all lanes and takes them back:
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
class lane_pack {
    using Shape = typename Flow::shape_type;
    using real = pack<N>;

public:
    // Lane i of the pack is lane first + i of the host.
    lane_pack(Host& host, int first) : host_(host), first_(first) {}

    void board() {
        for (int i = 0; i < N; ++i) {
            flight_.systems.free.flow.ahead.entry[i] = &nothing_; // read, not used, in an idle lane
            load(i);
        }
    }
    bool busy() const { return runs_ > 0; }

    // A round: look(), the stages of round(), strike(), attend().
    VI_HOT void look() {
        horizon_ = end_ - (high_ + low_);
        flight_.look(horizon_, busy_);
    }
    VI_HOT auto& round() { return flight_.round; }
    VI_HOT void strike() {
        flight_.strike(busy_);
        count_landed();
    }
    VI_HOT void attend() {
        const auto attention = busy_ & (flight_.stuck | (flight_.end.landed & watched()));
        if (!any(attention)) return;
        for (int i = 0; i < N; ++i)
            if (lane(attention, i)) attend(i, lane(horizon_, i));
    }

    void interrupt() {
        for (int i = 0; i < N; ++i) {
            if (!lane(busy_, i)) continue;
            suspend(i);
            host_.end(first_ + i, slots_[i], run_end::interrupted);
        }
    }

private:
    // Events that are not simply counted: shown to the host, or at a limit.
    pack_mask<N> watched() const {
        return (high_ + low_ >= watch_) | (impacts_ >= most_impacts_) | (events_ >= most_events_) |
               !(flight_.end.duration > 0.0);
    }

    void count_landed() {
        const auto& landed = flight_.end.landed;
        const real t = select(landed, flight_.end.duration, real(0.0));
        const real sum = high_ + t, part = sum - high_; // clock::add
        low_ = low_ + ((high_ - (sum - part)) + (t - part));
        high_ = sum;
        const real one = select(landed, real(1.0), real(0.0));
        impacts_ = impacts_ + one;
        events_ = events_ + one;
    }

    void load(int i) {
        auto& slot = slots_[i];
        const bool another = host_.next(first_ + i, slot);
        runs_ += another - lane(busy_, i);
        set_lane(busy_, i, another);
        if (!another) return;
        put_system(flight_.systems, i, *slot.system);
        resume(i);
        set_lane(end_, i, slot.limit.t_max);
        set_lane(watch_, i, slot.watch);
        set_lane(most_impacts_, i, static_cast<double>(slot.limit.impacts));
        set_lane(most_events_, i, static_cast<double>(slot.limit.events));
    }

    // From the slot into the lane.
    void resume(int i) {
        const auto& slot = slots_[i];
        put_trajectory(flight_.all, i, slot.at, slot.system->dimension(), slot.system->contacts());
        set_lane(high_, i, slot.so_far.now.high);
        set_lane(low_, i, slot.so_far.now.low);
        set_lane(impacts_, i, static_cast<double>(slot.so_far.impacts));
        set_lane(events_, i, static_cast<double>(slot.so_far.events));
    }

    // From the lane into the slot; a landed event is counted already.
    void suspend(int i) {
        auto& slot = slots_[i];
        const int n = slot.system->dimension(), contacts = slot.system->contacts();
        slot.at = take_trajectory(flight_.all, i, n, contacts);
        slot.so_far.now = {lane(high_, i), lane(low_, i)};
        slot.so_far.impacts = static_cast<long>(lane(impacts_, i));
        const long events = static_cast<long>(lane(events_, i));
        if (events - lane(flight_.end.landed, i) != slot.so_far.events) slot.so_far.at_once = 0;
        slot.so_far.events = events;
    }

    event<double, Shape> landed_event(int i) const {
        event<double, Shape> e{status::impact,
                               static_cast<int>(lane(flight_.end.contact, i)),
                               static_cast<int>(lane(flight_.end.side, i)),
                               0,
                               lane(flight_.end.duration, i),
                               lane(flight_.end.rate, i),
                               lane(flight_.rate_after, i),
                               {}};
        for (int j = 0; j < slots_[i].system->dimension(); ++j)
            e.before[j] = lane(flight_.before[j], i);
        return e;
    }

    // The event of one lane, as in run().
    void attend(int i, double left) {
        auto& slot = slots_[i];
        suspend(i);
        event<double, Shape> e;
        if (lane(flight_.stuck, i)) {
            e = detail::go_on(*slot.system, slot.at, slot.at.y, lane(flight_.all.flown, i), left);
            if (e.what == status::missing_mode) {
                if (e.code < 0 || !host_.build(first_ + i, e.code))
                    return finish(i, run_end::missing);
                return resume(i);
            }
            count(slot.so_far, e);
        } else {
            e = landed_event(i);
            slot.so_far.at_once = e.duration > 0.0 ? 0 : slot.so_far.at_once + 1;
        }
        const bool seen = slot.so_far.now.time() >= slot.watch;
        const bool go_on = !seen || host_.see(first_ + i, e, slot.at, slot.so_far.now);
        const run_end why = end_of_run(slot.so_far, e, slot.limit, left);
        if (why != run_end::none) return finish(i, why);
        if (!go_on) return finish(i, run_end::observer);
        if (slot.so_far.events >= slot.limit.events) return finish(i, run_end::events);
        if (lane(flight_.stuck, i)) resume(i); // a landing is in the lane already
    }

    void finish(int i, run_end why) {
        host_.end(first_ + i, slots_[i], why);
        load(i);
    }

    static constexpr typename Flow::stored nothing_{};

    Host& host_;
    int first_;
    lane_slot<Flow> slots_[N];
    lane_flight<N, Shape> flight_;
    real horizon_{};
    real high_{}, low_{}, end_{}, watch_{}, impacts_{}, events_{}, most_impacts_{}, most_events_{};
    pack_mask<N> busy_{};
    int runs_ = 0; // lanes that are busy
};

// Two packs keep the units of a core busy where one waits; more leave no room in its nearest cache.
inline constexpr int packs_in_turn = 2;

template <int N, class Flow, class Host>
class lane_run {
public:
    static constexpr int lanes = packs_in_turn * N; // that the host sees

    explicit lane_run(Host& host) : host_(host), packs_{{host, 0}, {host, N}} {}

    void run() {
        for (auto& pack : packs_)
            pack.board();
        for (long round = 1; packs_[0].busy() || packs_[1].busy(); ++round) {
            if (round % between_questions == 0 && host_.interrupted()) return interrupt();
            each_busy([](auto& pack) VI_WITHIN { pack.look(); });
            each_busy([](auto& pack) VI_WITHIN { pack.round().look_again(); });
            each_busy([](auto& pack) VI_WITHIN { pack.round().aim(); });
            each_busy([](auto& pack) VI_WITHIN { pack.round().approach(); });
            each_busy([](auto& pack) VI_WITHIN { pack.round().predict(); });
            each_busy([](auto& pack) VI_WITHIN { pack.round().close_in(); });
            each_busy([](auto& pack) VI_WITHIN { pack.round().land(); });
            each_busy([](auto& pack) VI_WITHIN { pack.strike(); });
            each_busy([](auto& pack) { pack.attend(); });
        }
    }

private:
    template <class Stage>
    VI_HOT void each_busy(const Stage& stage) {
        for (auto& pack : packs_)
            if (pack.busy()) stage(pack);
    }
    void interrupt() {
        for (auto& pack : packs_)
            pack.interrupt();
    }

    Host& host_;
    lane_pack<N, Flow, Host> packs_[packs_in_turn];
};

} // namespace vi
