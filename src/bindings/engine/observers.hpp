// Observers of the bindings: a record, a count, the growth of a tangent vector.
#pragma once

#include "engine/physical_map.hpp"
#include "vibroimpact/observe/follow_tangents.hpp"

namespace binding {

template <class Shape>
struct recorder {
    const physical_maps& physical;
    int n, lines;
    int mode;     // whose coordinates the state before the event has
    bool follows; // whether that is the one of the flight: velocities without mass are its own
    record out{};

    bool see(const vi::event<double, Shape>& e, const vi::trajectory<double, Shape>& at,
             const vi::clock& now) {
        out.status.push_back(static_cast<int>(e.what));
        out.contact.push_back(e.contact);
        out.side.push_back(e.side);
        out.mode.push_back(at.mode);
        out.high.push_back(now.high);
        out.low.push_back(now.low);
        out.rate_before.push_back(e.rate_before);
        out.rate_after.push_back(e.rate_after);
        out.y.insert(out.y.end(), at.y.x, at.y.x + n);
        physical.append(out.before, mode, e.before);
        physical.append(out.after, at.mode, at.y);
        if (follows) mode = at.mode;
        for (int l = 0; l < lines; ++l)
            out.phase.push_back(vi::phase_of(physical[0], l, at.y, n));
        return true;
    }
};

struct counter {
    long events = 0;

    template <class Event, class Trajectory>
    bool see(const Event&, const Trajectory&, const vi::clock&) {
        ++events;
        return true;
    }
};

// Log growth of tangent vectors in blocks of events; stops when the first has vanished.
template <class Flow, int W>
struct growth_meter {
    using Shape = typename Flow::shape_type;
    using jet = vi::jet<double, W>;
    long block;
    vi::growth<W>& tangent;
    vi::tangent_follower<Flow, W> follower;
    lyapunov_result out{};
    long in_block = 0;

    bool see(const vi::event<jet, Shape>& e, vi::trajectory<jet, Shape>& at, const vi::clock& now) {
        follower.see(e, at, now);
        if (tangent.broken || tangent.sum[0] == -vi::infinity()) return false;
        ++out.events;
        if (++in_block == block) {
            out.growth.insert(out.growth.end(), tangent.sum, tangent.sum + tangent.count);
            out.time.push_back(now.time());
            in_block = 0;
        }
        return true;
    }
};

template <class Jet>
struct duration_sum {
    int events = 0;
    Jet duration{0.0};

    template <class Event, class Trajectory>
    bool see(const Event& e, const Trajectory&, const vi::clock&) {
        ++events;
        duration = duration + e.duration;
        return true;
    }
};

} // namespace binding
