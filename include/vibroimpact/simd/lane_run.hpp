// Many runs, one per lane; a lane whose run has ended takes the next one.
//
// Method      What run.hpp does for one trajectory, for all lanes at once: clocks and counts are packs,
//             and an impact that is not shown costs nothing beyond them. An event that is to be
//             seen, that ends a run, or that a certified step brought, is handled lane by lane.
//             Packs of lanes take turns at the stages of a round. T is a pack, or a jet of packs: then
//             every run carries a tangent, whose growth is followed in all lanes at once. A lane whose
//             run has ended takes the next one, or waits a while for lanes that repeat their flights
//             (search/grid/recall_period.hpp).
//             The host lends runs to all lanes and takes them back:
//               bool next(i, slot)      another run for lane i; false if there is none, for good and for
//                                       all lanes. Flights are limited by slot.limit.t_max alone.
//               bool see(i, e, at, now) an event at or after slot.shown_from; false leaves the run
//               bool build(i, code)     the mode of a closed set that is missing; false if it cannot
//               void end(i, slot, why)  the run of lane i has ended, or had no event left to begin with
//               bool interrupted()      called now and then; true ends all runs
//             It shows events without derivatives; slot.tangent begins and ends with the slot. slot.run
//             is the host's and stays where it is from next() to end(), up to date in see() and end() only.
// Accuracy    bits of run(), with growth as its observer in lanes of jets: the same operations for
//             each trajectory in the same order
#pragma once

#include "vibroimpact/observe/follow_tangents.hpp"
#include "vibroimpact/simd/lanes.hpp"

namespace vi {

template <class Flow>
struct lane_slot {
    const hybrid<Flow>* system = nullptr;
    motion<double, Flow>* run = nullptr;
    limits limit{};
    double shown_from = 0.0; // events before this time are not shown
    growth<1> tangent{};     // in lanes of jets
    long version = 0;        // of what `system` points to: another number, another system
};

// System of each lane; a change of the version says that another system is meant.
template <int N, class Flow>
struct lane_keys {
    const hybrid<Flow>* system[N] = {};
    long version[N] = {};

    // False if lane i has it already.
    bool put(int i, const hybrid<Flow>& another, long number) {
        if (system[i] == &another && version[i] == number) return false;
        system[i] = &another;
        version[i] = number;
        return true;
    }
};

// Bounces of one lane, one after the other, before all others go on.
inline constexpr int most_bounces = 64;

// For every round that a busy lane flies, as much of one may pass an idle one that waits.
inline constexpr double waiting_share = 1.0 / 16;

// With tangents: where the flights of lanes began.
template <class T, class Shape, bool Tangents>
struct begun_flights : lane_trajectories<T, Shape> {};
template <class T, class Shape>
struct begun_flights<T, Shape, false> {};

// The runs in the lanes of a pack, as the host lends them: their clocks and counts.
template <int N, class Flow, class Host>
class lane_runs {
    using Shape = typename Flow::shape_type;

public:
    static constexpr int lanes = N;
    bool busy() const { return runs_ > 0; }

protected:
    using real = pack<N>;

    // Lane i of the pack is lane first + i of the host. Steps of single lanes add to `work`.
    void set_host(Host& host, int first, long& work) {
        host_ = &host;
        first_ = first;
        work_ = &work;
    }

    // Another run for lane i; false if the host has none.
    bool take_run(int i) {
        auto& slot = slots_[i];
        more_ = host_->next(first_ + i, slot);
        while (more_ && slot.run->so_far.events >= slot.limit.events) {
            host_->end(first_ + i, slot, run_end::events);
            more_ = host_->next(first_ + i, slot);
        }
        if (!more_) return false;
        ++runs_;
        set_lane(busy_, i, true);
        set_lane(until_, i, slot.limit.t_max);
        set_lane(shown_from_, i, slot.shown_from);
        return true;
    }
    void return_run(int i, run_end why) {
        host_->end(first_ + i, slots_[i], why);
        set_lane(busy_, i, false);
        --runs_;
    }

    // Events of some lanes, so long after the last.
    VI_HOT void count(const pack_mask<N>& lanes, const real& duration) {
        const real t = only(lanes, duration);
        const real sum = high_ + t, part = sum - high_; // clock::add
        low_ = low_ + ((high_ - (sum - part)) + (t - part));
        high_ = sum;
        events_ = plus_where(lanes, events_, real(1.0));
    }

    // Show an event that is counted, as in run(): why it is the last, or run_end::none.
    run_end show(int i, const event<double, Shape>& e) {
        const auto& slot = slots_[i];
        const auto& [at, so_far] = *slot.run;
        const bool shown = so_far.now.time() >= slot.shown_from;
        const bool goes_on = !shown || host_->see(first_ + i, e, at, so_far.now);
        const run_end why = end_of_run(so_far, e, slot.limit, run_end::horizon);
        if (why == run_end::none && !goes_on) return run_end::observer;
        if (why == run_end::none && so_far.events >= slot.limit.events) return run_end::events;
        return why;
    }

    Host* host_ = nullptr;
    long* work_ = nullptr;
    int first_ = 0;
    lane_slot<Flow> slots_[N];
    lane_keys<N, Flow> keys_; // of the systems whose numbers the lanes hold
    real high_{}, low_{}, until_{}, shown_from_{}, events_{};
    pack_mask<N> busy_{};
    int runs_ = 0;     // lanes that are busy
    bool more_ = true; // whether the host may have another run
};

template <class T, class Flow, class Host>
class lane_pack : public lane_runs<scalar_traits<T>::lanes, Flow, Host> {
    static constexpr int N = scalar_traits<T>::lanes;
    using runs = lane_runs<N, Flow, Host>;
    using runs::busy_, runs::events_, runs::first_, runs::high_, runs::host_, runs::keys_,
        runs::low_;
    using runs::more_, runs::runs_, runs::shown_from_, runs::slots_, runs::until_, runs::work_;
    using Shape = typename Flow::shape_type;
    using real = real_t<T>;
    using alone = lane_t<T>;
    using state = vec<T, Shape::max_dimension>;
    static constexpr bool has_tangent = scalar_traits<T>::is_jet;

public:
    void begin_runs(Host& host, int first, long& work) {
        this->set_host(host, first, work);
        for (int i = 0; i < N; ++i)
            flight_.systems.free.flow.ahead.entry[i] = &nothing_; // read, not used, in an idle lane
        fill();
    }
    // A round: begin(), scan() and evaluate() of a round() that scans, its stages, end_round().
    VI_HOT void begin() { flight_.begin(time_left(), busy_); }
    VI_HOT bool scans() const { return flight_.round.scans(); }
    VI_HOT auto& round() { return flight_.round; }
    template <class Take>
    VI_HOT static void each_stage(const Take& take) {
        decltype(flight_.round)::each_stage(take);
    }
    VI_HOT void end_round() {
        quick_landing<T> end;
        state before;
        flight_.impacts(busy_, end, before);
        this->count(end.landed, value(end.duration));
        if constexpr (has_tangent) {
            const auto& flow = flight_.flow();
            auto& at = flight_.all.at;
            const auto faded = tangents_.faded(end.landed, at, norm_, flow.dimension());
            tangents_.see(end.landed & !faded, at, high_ + low_, norm_, flow.dimension(),
                          flow.contacts());
            if (any(faded)) follow_again(faded, end);
            flow.each_coordinate([&](auto j) VI_WITHIN {
                begun_.at.y[j] = select(end.landed, at.y[j], begun_.at.y[j]);
            });
            flow.each_contact([&](auto k) VI_WITHIN {
                begun_.at.touching[k] = select(end.landed, at.touching[k], begun_.at.touching[k]);
                begun_.at.rate[k] = select(end.landed, at.rate[k], begun_.at.rate[k]);
                begun_.at.flat[k] = select(end.landed, at.flat[k], begun_.at.flat[k]);
            });
        }
        const auto attention = busy_ & (flight_.stuck | (end.landed & needs_handling(end)));
        if (any(attention)) {
            end_ = end;
            before_ = before;
            handle(attention);
        }
        patience_ += waiting_share * runs_;
        if (runs_ < N && more_ && !waits()) fill();
    }

    void interrupt() {
        for (int i = 0; i < N; ++i) {
            if (!lane(busy_, i)) continue;
            suspend(i, false);
            finish(i, run_end::interrupted);
        }
    }

private:
    real time_left() const { return until_ - (high_ + low_); }
    double time_left(int i) const { return lane(until_, i) - (lane(high_, i) + lane(low_, i)); }

    // Events that are not simply counted: shown to the host, or at a limit.
    pack_mask<N> needs_handling(const quick_landing<T>& end) const {
        return (high_ + low_ >= shown_from_) | (events_ >= most_) | !(end.duration > 0.0);
    }

    // While no lane scans, a run from its start would make all others wait. Idle lanes wait for these
    // instead, up to a part of the work that is done: so runs of a pack begin, and come to repeat, together.
    bool waits() {
        if (!this->busy() || flight_.round.scans()) return false;
        patience_ -= N - runs_;
        return patience_ > 0.0;
    }

    void fill() {
        for (int i = 0; i < N && more_; ++i)
            if (!lane(busy_, i)) load(i);
    }

    void load(int i) {
        if (!this->take_run(i)) return;
        auto& slot = slots_[i];
        if (keys_.put(i, *slot.system, slot.version)) {
            put_system(flight_.systems, i, *slot.system);
            if constexpr (has_tangent) set_lane(norm_, i, norm_of(*slot.system));
        }
        if constexpr (has_tangent) {
            const auto at = with_tangents<1>(*slot.system, slot.run->at, 1);
            resume(i, at);
            set_lane(tangents_, i, slot.tangent);
            put_state(begun_, i, at, slot.system->dimension(), slot.system->contacts());
        } else {
            resume(i, slot.run->at);
        }
    }

    // From the slot into the lane, the trajectory being there.
    void resume(int i, const trajectory<alone, Shape>& at) {
        const auto& slot = slots_[i];
        const auto& so_far = slot.run->so_far;
        put_trajectory(flight_.all, i, at, slot.system->dimension(), slot.system->contacts());
        set_lane(high_, i, so_far.now.high);
        set_lane(low_, i, so_far.now.low);
        set_lane(events_, i, static_cast<double>(so_far.events));
        const long impacts_left = slot.limit.impacts - so_far.impacts;
        const long events_left = slot.limit.events - so_far.events;
        const long left = impacts_left < events_left ? impacts_left : events_left;
        set_lane(most_, i, static_cast<double>(so_far.events + left));
    }

    // From the lane into the slot; a landed event is counted already.
    void suspend(int i, bool landed) {
        const auto& system = *slots_[i].system;
        auto& [at, so_far] = *slots_[i].run;
        take_trajectory(flight_.all, i, system.dimension(), system.contacts(), at);
        so_far.now = {lane(high_, i), lane(low_, i)};
        const long events = static_cast<long>(lane(events_, i)); // impacts all that are new
        so_far.impacts += events - so_far.events;
        if (events - landed != so_far.events) so_far.at_once = 0;
        so_far.events = events;
    }

    void take_landing(int i, event<double, Shape>& e) {
        auto& [at, so_far] = *slots_[i].run;
        e.what = status::impact;
        e.contact = static_cast<int>(lane(end_.stop.contact, i));
        e.side = static_cast<int>(lane(end_.stop.side, i));
        e.duration = take_lane<double>(end_.duration, i);
        e.rate_before = -lane(end_.stop.side, i) * take_lane<double>(end_.speed, i);
        e.rate_after = at.rate[e.contact];
        const auto& system = *slots_[i].system;
        vec<double, Shape::max_dimension> before;
        system.each_coordinate([&](auto j)
                                   VI_WITHIN { before[j] = take_lane<double>(before_[j], i); });
        detail::put_before(at.y, before, system, e.before);
        so_far.at_once = e.duration > 0.0 ? 0 : so_far.at_once + 1;
    }

    // After an event of one lane; the flight to the next begins there.
    void follow_tangent(int i, const event<alone, Shape>& e, trajectory<alone, Shape>& at,
                        const clock& now) {
        const auto& system = *slots_[i].system;
        const int n = system.dimension(), contacts = system.contacts();
        trajectory<alone, Shape> last{};
        take_trajectory(begun_, i, n, contacts, last);
        auto tangent = lane(tangents_, i);
        follow(system, lane(norm_, i), last, e, at, now, tangent);
        set_lane(tangents_, i, tangent);
        put_state(begun_, i, at, n, contacts);
    }

    // Impacts after flights that have left little of a tangent.
    [[gnu::noinline]] void follow_again(const pack_mask<N>& lanes, const quick_landing<T>& end) {
        for (int i = 0; i < N; ++i) {
            if (!lane(lanes, i)) continue;
            const auto& system = *slots_[i].system;
            const int n = system.dimension(), contacts = system.contacts();
            event<alone, Shape> e{};
            e.what = status::impact;
            e.contact = static_cast<int>(lane(end.stop.contact, i));
            e.side = static_cast<int>(lane(end.stop.side, i));
            e.duration = lane(end.duration, i);
            trajectory<alone, Shape> at{};
            take_trajectory(flight_.all, i, n, contacts, at);
            follow_tangent(i, e, at, {lane(high_, i), lane(low_, i)});
            put_state(flight_.all, i, at, n, contacts);
        }
    }

    [[gnu::noinline]] void handle(const pack_mask<N>& lanes) {
        for (int i = 0; i < N; ++i)
            if (lane(lanes, i)) handle(i, lane(flight_.stuck, i) ? time_left(i) : 0.0);
    }

    // One lane. The slot holds a trajectory without its tangent.
    void handle(int i, double left) {
        auto& at = slots_[i].run->at;
        suspend(i, lane(end_.landed, i));
        if (!lane(flight_.stuck, i)) {
            event<double, Shape> e;
            take_landing(i, e);
            report(i, e);
        } else if constexpr (has_tangent) {
            const auto& system = *slots_[i].system;
            trajectory<alone, Shape> with_tangent{};
            take_trajectory(flight_.all, i, system.dimension(), system.contacts(), with_tangent);
            certify(i, with_tangent, left);
        } else {
            certify(i, at, left);
        }
    }

    // The certified step of a lane that is stuck, from `at` on, and micro-bounces that follow; back into the lane.
    void certify(int i, trajectory<alone, Shape>& at, double left) {
        const auto& slot = slots_[i];
        auto& all = flight_.all;
        const int earlier = static_cast<int>(lane(all.applications, i));
        const alone flown = lane(all.flown, i);
        auto e = detail::continue_certified(*slot.system, at, flown, earlier, left);
        if (detail::is_unfinished(e.what)) {
            if (e.what == status::searching) *work_ += steps_in_a_row;
            resume(i, at);
            set_lane(all.flown, i, e.duration);
            set_lane(all.applications, i, e.applications);
            return;
        }
        for (int bounces = 0; e.what != status::paused; ++bounces) {
            if (e.what == status::missing_mode) {
                resume(i, at);
                if (bounces == 0) { // the leg did not happen: the flight is where it was
                    set_lane(all.flown, i, flown);
                    set_lane(all.applications, i, earlier);
                }
                return request_mode(i, e.wanted);
            }
            count(slot.run->so_far, e);
            if (!report_certified(i, e, at)) return;
            if (bounces == most_bounces) break;
            ++*work_;
            left = slot.limit.t_max - slot.run->so_far.now.time();
            e = micro_bounce_step(*slot.system, at, left);
        }
        resume(i, at);
    }

    bool report_certified(int i, const event<alone, Shape>& e, trajectory<alone, Shape>& at) {
        if constexpr (has_tangent) {
            const auto& system = *slots_[i].system;
            follow_tangent(i, e, at, slots_[i].run->so_far.now);
            slots_[i].run->at = detail::values(at, system.dimension(), system.contacts());
            return report(i, detail::values(e, system.dimension()));
        } else {
            return report(i, e);
        }
    }

    // An event that is counted; false if it is the last.
    bool report(int i, const event<double, Shape>& e) {
        const run_end why = this->show(i, e);
        if (why != run_end::none) finish(i, why);
        return why == run_end::none;
    }

    void request_mode(int i, int code) {
        if (code < 0 || !host_->build(first_ + i, code)) finish(i, run_end::missing);
    }

    void finish(int i, run_end why) {
        if constexpr (has_tangent) slots_[i].tangent = lane(tangents_, i);
        this->return_run(i, why);
    }

    static constexpr typename Flow::stored nothing_{};

    lane_flight<T, Shape> flight_;
    quick_landing<T> end_; // of the last round in which a lane needed attention
    state before_;
    real most_{}; // of the next events, impacts as a rule, so many may come
    growth<1, real> tangents_{};
    tangent_norm<real, has_tangent ? Shape::max_dimension : 1> norm_{};
    [[no_unique_address]] begun_flights<T, Shape, has_tangent> begun_{};
    double patience_ = 0.0; // so many rounds idle lanes may wait, all together
};

// Several packs keep the units of a core busy where one waits; more leave no room in its nearest cache.
template <class T>
inline constexpr int packs_in_turn = scalar_traits<T>::is_jet ? 2 : 4;
template <class T>
inline constexpr int lanes_in_turn = packs_in_turn<T> * scalar_traits<T>::lanes; // that a host sees

// Packs of lanes take turns, so many as there are.
template <class Pack, int Packs, class Host>
class packs_run {
    static_assert(sizeof(spaced<Pack>) / 64 % 2 == 1);

public:
    explicit packs_run(Host& host) : host_(host) {}

    void run() {
        for (int i = 0; i < Packs; ++i)
            packs_[i].begin_runs(host_, i * Pack::lanes, work_);
        while (busy()) {
            if (is_due() && host_.interrupted()) return interrupt();
            each_busy([](auto& pack) VI_WITHIN { pack.begin(); });
            scan_ahead();
            Pack::each_stage([&](const auto& stage) VI_WITHIN {
                each_busy([&](auto& pack) VI_WITHIN { stage(pack.round()); });
            });
            each_busy([](auto& pack) VI_WITHIN { pack.end_round(); });
        }
    }

private:
    // Whether to check for an interrupt.
    bool is_due() {
        if (++work_ < between_interrupt_checks) return false;
        work_ = 0;
        return true;
    }
    bool busy() const {
        for (const auto& pack : packs_)
            if (pack.busy()) return true;
        return false;
    }
    template <class Stage>
    VI_HOT void each_busy(const Stage& stage) {
        for (auto& pack : packs_)
            if (pack.busy()) stage(pack);
    }
    VI_RARE void scan_ahead() {
        each_busy([](auto& pack) VI_WITHIN {
            if (pack.scans()) pack.round().scan();
        });
        each_busy([](auto& pack) VI_WITHIN {
            if (pack.scans()) pack.round().evaluate();
        });
    }
    void interrupt() {
        for (auto& pack : packs_)
            pack.interrupt();
    }

    Host& host_;
    long work_ = 0; // rounds, and steps of single lanes, since the last check for an interrupt
    spaced<Pack> packs_[Packs];
};

template <class T, class Flow, class Host>
using lane_run = packs_run<lane_pack<T, Flow, Host>, packs_in_turn<T>, Host>;

} // namespace vi
