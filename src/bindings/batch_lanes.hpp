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
    lane_host(const batch_data& batch, const members& all, const observer_options& options,
              observed& out)
        : members_(all) {
        berths_.reserve(lanes_of_target);
        for (int i = 0; i < lanes_of_target; ++i)
            berths_.emplace_back(batch, all, options, out);
    }

    bool next(int i, vi::lane_slot<Flow>& slot) {
        auto& here = berths_[i];
        while (!stopped_ && next_ < members_.count()) {
            if (next_ % members_between_questions == 0 && interrupted()) return false;
            if (!here.board(next_++)) continue;
            if (until(here) > 0.0) {
                fill(slot, here);
                return true;
            }
            here.leave_with_tangents();
        }
        return false;
    }

    bool see(int i, const vi::event<double, typename Flow::shape_type>& e,
             const vi::trajectory<double, typename Flow::shape_type>& at, const vi::clock& now) {
        auto& here = berths_[i];
        here.observers().see(here.hybrid(), e, at, now);
        return now.time() < until(here);
    }

    bool build(int i, int code) { return berths_[i].build(code); }

    void end(int i, const vi::lane_slot<Flow>& slot, vi::run_end why) {
        auto& here = berths_[i];
        here.member() = {slot.at, slot.so_far};
        if (why == vi::run_end::observer)
            here.leave_with_tangents();
        else
            here.leave(vi::end_of_member(why));
    }

    bool interrupted() {
        stopped_ = stopped_ || members_.interrupted();
        return stopped_;
    }

private:
    static double until(const berth<Flow>& here) {
        return here.wants_tangents() ? vi::begin_of_tangents(here.window()) : vi::infinity();
    }

    // From when on events are to be shown: an impact that nobody watches costs nothing.
    static double watched_from(berth<Flow>& here) {
        const auto& all = here.observers();
        if (all.wants(vi::sees_flights)) return 0.0;
        return all.wants(~0u) ? vi::min(here.window().settle, until(here)) : until(here);
    }

    static void fill(vi::lane_slot<Flow>& slot, berth<Flow>& here) {
        slot.system = &here.hybrid();
        slot.at = here.member().at;
        slot.so_far = {};
        slot.limit = vi::limits_of(here.window());
        slot.watch = watched_from(here);
    }

    const members& members_;
    std::vector<berth<Flow>> berths_;
    std::size_t next_ = 0;
    bool stopped_ = false;
};

template <class Flow>
observed run_in_lanes(const batch_data& batch, const members& all,
                      const observer_options& options) {
    observed out(batch, options, all.count());
    lane_host<Flow> host(batch, all, options, out);
    vi::lane_run<lanes_of_target, Flow, lane_host<Flow>>(host).run();
    return out;
}

} // namespace binding
