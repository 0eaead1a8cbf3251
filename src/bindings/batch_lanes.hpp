// Running the members of a batch in SIMD lanes, for one modal flow of the kernel.
#pragma once

#include "batch_of.hpp"
#include "vibroimpact/lane_run.hpp"

namespace binding {

// As many lanes as a register of the target has.
#if defined(__AVX512F__)
inline constexpr int lanes_of_target = 8;
#elif defined(__AVX__)
inline constexpr int lanes_of_target = 4;
#else
inline constexpr int lanes_of_target = 2;
#endif

// Members board in turn; each leaves when its run has ended, with tangents alone.
template <class Flow>
class lane_host {
public:
    lane_host(const batch_run& b, question ask) : members_(b.arrays.members), ask_(ask) {
        constexpr int lanes = vi::packs_in_turn * lanes_of_target;
        berths_.reserve(lanes);
        for (int i = 0; i < lanes; ++i)
            berths_.emplace_back(b, ask);
    }

    bool next(int i, vi::lane_slot<Flow>& slot) {
        auto& here = berths_[i];
        while (!stopped_ && next_ < members_) {
            if (next_ % members_between_questions == 0 && interrupted()) return false;
            if (!here.board(next_++)) continue;
            if (here.until() > 0.0) {
                fill(slot, here);
                return true;
            }
            here.finish(vi::run_end::observer);
        }
        return false;
    }

    bool see(int i, const vi::event<double, typename Flow::shape_type>& e,
             const vi::trajectory<double, typename Flow::shape_type>& at, const vi::clock& now) {
        auto& here = berths_[i];
        here.observers().see(here.hybrid(), e, at, now);
        return now.time() < here.until();
    }

    bool build(int i, int code) { return berths_[i].build(code); }

    void end(int i, const vi::lane_slot<Flow>& slot, vi::run_end why) {
        auto& here = berths_[i];
        here.member() = {slot.at, slot.so_far};
        here.finish(why);
    }

    bool interrupted() {
        stopped_ = stopped_ || ask_();
        return stopped_;
    }

private:
    // From when on events are to be shown: an impact that nobody watches costs nothing.
    static double watched_from(berth<Flow>& here) {
        const auto& all = here.observers();
        if (all.wants(vi::sees_flights)) return 0.0;
        return all.wants(~0u) ? vi::min(here.window().settle, here.until()) : here.until();
    }

    static void fill(vi::lane_slot<Flow>& slot, berth<Flow>& here) {
        slot.system = &here.hybrid();
        slot.at = here.member().at;
        slot.so_far = {};
        slot.limit = vi::limits_of(here.window());
        slot.watch = watched_from(here);
    }

    long long members_;
    question ask_;
    std::vector<berth<Flow>> berths_;
    long long next_ = 0;
    bool stopped_ = false;
};

template <class Flow>
void run_in_lanes(const batch_run& b, question ask) {
    lane_host<Flow> host(b, ask);
    vi::lane_run<lanes_of_target, Flow, lane_host<Flow>>(host).run();
}

} // namespace binding
