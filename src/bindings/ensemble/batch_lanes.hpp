// Running the members of a batch in SIMD lanes, for one modal flow of the kernel.
//
// Method      Lanes of numbers take the members in turn. Where the largest exponent is wanted, members
//             leave them when tangents begin (ensemble.hpp), and wait, with their systems. When
//             there are `most_settled`, lanes of jets take these to the end of their windows; then
//             the lanes of numbers go on. All exponents of a member are found alone.
// Accuracy    that of lane_run.hpp: no bit depends on who runs beside whom, or when
#pragma once

#include <iterator>

#include "ensemble/batch_of.hpp"
#include "vibroimpact/simd/lane_run.hpp"
#include "vibroimpact/simd/mode_lanes.hpp"

namespace binding {

inline constexpr int lanes = vi::lanes_in_turn<vi::pack<vi::native_lanes>>;

template <class Flow>
using member_slots = std::vector<std::unique_ptr<member_slot<Flow>>>;
// Members that wait: enough to keep lanes busy, few enough for what they need to stay near.
inline constexpr int most_settled = 64;

// A check for interruption that is not made again once the answer was yes.
class lasting_interrupt {
public:
    explicit lasting_interrupt(interrupt_check interrupted) : interrupted_(interrupted) {}
    bool is_set() const { return set_; }
    bool check() { return set_ = set_ || interrupted_(); }

private:
    interrupt_check interrupted_;
    bool set_ = false;
};

// A member that is to run until then. An impact that no observer is shown costs nothing.
template <class Flow>
void fill(vi::lane_slot<Flow>& slot, member_slot<Flow>& here, double until) {
    slot.system = &here.hybrid();
    slot.version = here.version();
    slot.run = &here.motion();
    slot.limit = vi::limits_of(here.window());
    slot.shown_from = vi::min(here.observers().shown_from(), until);
}

// Members that have settled, with a tangent each.
template <class Flow>
class tangent_host {
    using Shape = typename Flow::shape_type;

public:
    tangent_host(const member_slots<Flow>& settled, lasting_interrupt& stop)
        : settled_(settled), stop_(stop) {}

    bool next(int i, vi::lane_slot<Flow>& slot) {
        if (stop_.is_set() || next_ == settled_.size()) return false;
        here_[i] = settled_[next_++].get();
        fill(slot, *here_[i], vi::infinity());
        slot.tangent = {here_[i]->window().settle};
        return true;
    }

    bool see(int i, const vi::event<double, Shape>& e, const vi::trajectory<double, Shape>& at,
             const vi::clock& now) {
        here_[i]->observers().on_event(here_[i]->hybrid(), e, at, now);
        return true;
    }

    bool build(int i, int code) { return here_[i]->build(code); }

    void end(int i, const vi::lane_slot<Flow>& slot, vi::run_end why) {
        here_[i]->finish(vi::end_of_member(why), slot.tangent);
    }

    bool interrupted() { return stop_.check(); }

private:
    const member_slots<Flow>& settled_;
    lasting_interrupt& stop_;
    member_slot<Flow>* here_[lanes] = {};
    std::size_t next_ = 0;
};

// All members of a batch, up to the begin of tangents; to their ends where these go on alone.
template <class Flow, bool Alone = false>
class lane_host {
    using Shape = typename Flow::shape_type;

public:
    lane_host(const batch_run& b, interrupt_check check)
        : b_(b), check_(check), stop_(check), systems_(b) {}

    bool next(int i, vi::lane_slot<Flow>& slot) {
        while (!stop_.is_set() && next_ < b_.arrays.members) {
            if (next_ % members_between_checks == 0 && interrupted()) return false;
            if (!here_[i]) take_slot(i);
            auto& here = *here_[i];
            if (!here.load(next_++)) continue;
            if (here.until() > 0.0) {
                fill(slot, here, here.until());
                return true;
            }
            leave(i, vi::run_end::observer);
        }
        return false;
    }

    bool see(int i, const vi::event<double, Shape>& e, const vi::trajectory<double, Shape>& at,
             const vi::clock& now) {
        auto& here = *here_[i];
        here.observers().on_event(here.hybrid(), e, at, now);
        return now.time() < here.until();
    }

    bool build(int i, int code) { return here_[i]->build(code); }

    void end(int i, const vi::lane_slot<Flow>&, vi::run_end why) { leave(i, why); }

    bool interrupted() { return stop_.check(); }

    // Of the modes that systems may have, built or not.
    int modes() const { return static_cast<int>(b_.arrays.modes); }
    int code(int m) const { return b_.arrays.codes[m]; }

    // Take those that wait to their ends.
    void run_settled() {
        if (settled_.empty()) return;
        tangent_host<Flow> host(settled_, stop_);
        using jets = vi::jet<vi::pack<vi::native_lanes>, 1>;
        std::make_unique<vi::lane_run<jets, Flow, tangent_host<Flow>>>(host)->run();
        std::move(settled_.begin(), settled_.end(), std::back_inserter(idle_));
        settled_.clear();
    }

private:
    void leave(int i, vi::run_end why) {
        const bool waits = !Alone && why == vi::run_end::observer && here_[i]->tangents() == 1;
        if (!waits) return here_[i]->finish(why);
        settled_.push_back(std::move(here_[i]));
        if constexpr (!Alone)
            if (settled_.size() == most_settled) run_settled();
    }

    void take_slot(int i) {
        if (idle_.empty())
            idle_.push_back(std::make_unique<member_slot<Flow>>(b_, systems_, check_));
        here_[i] = std::move(idle_.back());
        idle_.pop_back();
    }

    const batch_run& b_;
    interrupt_check check_;
    lasting_interrupt stop_;
    built_systems<Flow> systems_;
    std::unique_ptr<member_slot<Flow>> here_[lanes];
    member_slots<Flow> settled_, idle_;
    long long next_ = 0;
};

template <class Flow>
void run_in_lanes(const batch_run& b, interrupt_check interrupted) {
    lane_host<Flow> host(b, interrupted);
    using packs = vi::pack<vi::native_lanes>;
    std::make_unique<vi::lane_run<packs, Flow, lane_host<Flow>>>(host)->run(); // large for a stack
    host.run_settled();
}

// Of machines with elements: `Guarded` has their sizes.
template <class Flow, class Guarded>
void run_in_modes(const batch_run& b, interrupt_check interrupted) {
    using host_type = lane_host<Flow, true>;
    host_type host(b, interrupted);
    using run_type = vi::mode_run<vi::native_lanes, Flow, Guarded, host_type>;
    std::make_unique<run_type>(host)->run();
}

} // namespace binding
