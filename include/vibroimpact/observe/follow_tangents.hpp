// Tangents along a run, event by event: their growth (growth.hpp), long flights in pieces.
//
// Method      Where a flight has made tangents parallel, or has left nothing of the first but rounding of the
//             flow, they fly it again in pieces, orthonormal after each; the last piece brings the event.
// Fails       where the pieces do not lead to that event, the growth is that of the whole flight
#pragma once

#include "vibroimpact/engine/engine.hpp"
#include "vibroimpact/observe/growth.hpp"

namespace vi {

namespace detail {

// After a piece of some steps the fastest part is left by exp(-6) or more, and directions keep their digits.
inline constexpr double steps_of_piece = 8.0;

// Tangents without their parts along the flow, which an event takes away: what would be left of a vector
// that a long flight has turned into the flow is rounding.
template <int W, class Flow>
VI_HD inline void leave_out_flow(const Flow& flow, vec<jet<double, W>, Flow::max_dimension>& y,
                                 const tangent_norm<double, Flow::max_dimension>& norm, int n,
                                 int count) {
    const auto f = flow.derivative(values_of(y, n));
    double square = 0.0;
    for (int i = 0; i < n; ++i)
        square = square + norm.weights[i] * f[i] * f[i];
    for (int k = 0; square > 0.0 && k < count; ++k) {
        double along = 0.0;
        for (int i = 0; i < n; ++i)
            along = along + norm.weights[i] * f[i] * y[i].d[k];
        for (int i = 0; i < n; ++i)
            y[i].d[k] = y[i].d[k] - along / square * f[i];
    }
}

// Elements whose margins grow have left their limits; what stays on one goes on to do so.
template <int Watches>
VI_HD inline void leave_limits(element_states<Watches>& states) {
    if constexpr (Watches > 0)
        for (int j = 0; j < Watches; ++j)
            if (!states.stays_on(j)) states.zeros[j] = 0;
}

// The flight from a trajectory to its event, which left it `at`: the tangents of that from the `first` on, by
// way of pieces, whose growth is the answer. Nothing is changed where they do not lead to that event.
template <int W, class Flow>
VI_CALL growth<W>
in_pieces(const hybrid<Flow>& system, trajectory<jet<double, W>, typename Flow::shape_type> from,
          const event<jet<double, W>, typename Flow::shape_type>& e,
          trajectory<jet<double, W>, typename Flow::shape_type>& at,
          const tangent_norm<double, Flow::max_dimension>& norm, int first, int count) {
    const int n = system.dimension(), contacts = system.contacts();
    const auto& flow = system.modes[from.mode].flow;
    const double duration = plain(e.duration), piece = steps_of_piece * flow.step;
    const long pieces = static_cast<long>(duration / piece - 0.5); // 1/2 to 3/2 of one are left
    growth<W> sums, none;
    sums.count = count;
    sums.events = 1.0; // every growth counts, also that of leaving out the flow
    if (pieces < 1) return none;

    const double flown = static_cast<double>(pieces) * piece;
    const auto there = flow.flight(values_of(from.y, n), flown);
    const auto once = flow.at_time(piece);
    const auto see = [&] {
        // rounding brings in other amplitudes of the forcing, which never fade
        renormalise_forcing(from.y, n, system.lines(), system.inverse_omega_squared);
        leave_out_flow<W>(flow, from.y, norm, n, count);
        sums.see(true, from, 0.0, norm, n, contacts);
    };
    see();
    for (long i = 0; i < pieces; ++i) {
        from.y = flow.apply(once, from.y);
        see();
    }
    for (int i = 0; i < n; ++i)
        from.y[i].v = there[i];
    for (int i = 0; i < contacts; ++i)
        if (side_in_code(from.held, i) == 0.0) from.touching[i] = 0.0;
    leave_limits(from.elements);
    const auto last = step(system, from, duration - flown + piece);
    const bool same = last.what == e.what && last.contact == e.contact && last.side == e.side &&
                      from.mode == at.mode && from.held == at.held;
    if (!same || !(abs(plain(last.duration) - (duration - flown)) < 0x1p-20 * flow.step))
        return none;
    for (int k = first; k < count; ++k) {
        for (int i = 0; i < n; ++i)
            at.y[i].d[k] = from.y[i].d[k];
        for (int i = 0; i < contacts; ++i)
            at.rate[i].d[k] = from.rate[i].d[k];
    }
    return sums;
}

} // namespace detail

// After an event, with the trajectory with which the flight to it began.
template <int W, class Flow>
VI_HD inline void follow(const hybrid<Flow>& system,
                         const tangent_norm<double, Flow::max_dimension>& norm,
                         const trajectory<jet<double, W>, typename Flow::shape_type>& last,
                         const event<jet<double, W>, typename Flow::shape_type>& e,
                         trajectory<jet<double, W>, typename Flow::shape_type>& at,
                         const clock& now, growth<W>& sums) {
    auto tried = at;
    auto grown = sums;
    grown.see(e, tried, now, system, norm);
    if (!grown.lost) {
        sums = grown;
        at = tried;
        return;
    }
    const int first = sums.faded(true, at, norm, system.dimension()) ? 0 : 1;
    const auto pieces = detail::in_pieces(system, last, e, at, norm, first, sums.count);
    const bool counted = now.time() >= sums.settle && sums.events > 0.0;
    sums.see(e, at, now, system, norm);
    for (int k = first; counted && k < sums.count; ++k)
        sums.sum[k] = sums.sum[k] + pieces.sum[k];
    sums.lost = false;
}

// The growth of the tangents of a run that begins `at` a trajectory with them.
template <class Flow, int W>
class tangent_follower {
    using Shape = typename Flow::shape_type;
    using jets = trajectory<jet<double, W>, Shape>;

public:
    VI_HD tangent_follower(const hybrid<Flow>& system, growth<W>& sums, const jets& at)
        : system_(system), sums_(sums), norm_(norm_of(system)), last_(at) {}

    VI_HD void see(const event<jet<double, W>, Shape>& e, jets& at, const clock& now) {
        follow(system_, norm_, last_, e, at, now, sums_);
        last_ = at;
    }

private:
    const hybrid<Flow>& system_;
    growth<W>& sums_;
    tangent_norm<double, Flow::max_dimension> norm_;
    jets last_; // where the flight to the next event begins
};

} // namespace vi
