// What the bindings keep of a run: a record, a count, the growth of a tangent vector.
#pragma once

#include "physical_map.hpp"
#include "vibroimpact/run.hpp"
#include "vibroimpact/scalar/jet.hpp"

namespace binding {

template <class Shape>
struct recorder {
    const physical_maps& physical;
    int n, lines;
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
        physical.append(out.before, 0, e.before);
        physical.append(out.after, at.mode, at.y);
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

// Log growth of one tangent vector, renormalised at every event; stops when it has vanished.
template <class Shape>
struct growth_meter {
    using jet = vi::jet<double, 1>;
    static constexpr double vanished = 64.0 * vi::unit_roundoff; // what rounding leaves of length 1
    int n, contacts;
    long block;
    lyapunov_result out{};
    double log_sum = 0.0;
    long in_block = 0;

    bool see(const vi::event<jet, Shape>&, vi::trajectory<jet, Shape>& at, const vi::clock& now) {
        double square = 0.0;
        for (int i = 0; i < n; ++i)
            square += at.y[i].d[0] * at.y[i].d[0];
        const double length = vi::sqrt(square);
        if (!(length > vanished)) return false;
        log_sum += vi::log(length);
        for (int i = 0; i < n; ++i)
            at.y[i].d[0] = at.y[i].d[0] / length;
        for (int i = 0; i < contacts; ++i)
            at.rate[i].d[0] = at.rate[i].d[0] / length;
        ++out.events;
        if (++in_block == block) {
            out.growth.push_back(log_sum);
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
