// Several trajectories side by side, one per SIMD lane, each with parameters of its own.
//
// Method      The quick flight (event/quick_flight.hpp) runs on packs, masked; a lane that it cannot prove,
//             or that is at rest on a stop, takes the scalar certified step. Both are what the scalar
//             engine does with that trajectory, operation for operation: equal bits.
// Assumes     the free modes of all lanes have the same shape
#pragma once

#include "vibroimpact/engine.hpp"
#include "vibroimpact/scalar/pack.hpp"

namespace vi {

inline constexpr int lane_orders = 2; // derivatives of u that the quick flight reads as rows

template <int N, class Shape>
struct lanes {
    using real = pack<N>;
    using scalar_flow = modal_flow<double, Shape>;
    using flow = modal_flow<real, Shape>;
    static constexpr int D = Shape::max_dimension;
    static constexpr int K = Shape::max_contacts;

    const hybrid<scalar_flow>* systems[N];
    mode<real, flow, lane_orders> free;
    contact_law<real, D, K> laws[K];
    real inverse_omega_squared[max_lines];
    int lines;
};

template <int N, class Shape>
struct lane_trajectories {
    trajectory<pack<N>, Shape> at;
    int mode[N] = {}, held[N] = {};
};

template <int N, class Shape>
struct lane_events {
    event<double, Shape> of[N];
};

namespace detail {

// Fill lane i of a pack structure from a scalar one.
template <int N, class Shape>
inline void fill_flow(modal_flow<pack<N>, Shape>& to, const modal_flow<double, Shape>& from,
                      int i) {
    to.dimension_ = from.dimension_;
    to.contacts_ = from.contacts_;
    set_lane(to.step, i, from.step);
    for (int j = 0; j < from.blocks(); ++j) {
        set_lane(to.k[j], i, from.k[j]);
        set_lane(to.c[j], i, from.c[j]);
        set_lane(to.a[j], i, from.a[j]);
        for (int g = 0; g < grids; ++g)
            for (int t = 0; t <= grid_times; ++t)
                set_lane(to.grid[g][t].block[j], i, from.grid[g][t].block[j]);
        for (int t = 0; t <= parts_of_step; ++t)
            set_lane(to.part[t].block[j], i, from.part[t].block[j]);
    }
    for (int m = 0; m < taylor_order / 2; ++m)
        for (int j = 0; j < 2 * from.dimension(); ++j)
            set_lane(to.series[m][j], i, from.series[m][j]);
}

template <int N, int D>
inline void fill_preview(preview<pack<N>, D>& to, const preview<double, D>& from, int n, int i) {
    for (int k = 0; k < grid_times; ++k) {
        for (int j = 0; j < n; ++j)
            set_lane(to.rows[j][k], i, from.rows[j][k]);
        set_lane(to.gains[k], i, from.gains[k]);
    }
}

template <int N, int D, int Orders>
inline void fill_guard(guard<pack<N>, D, lane_orders>& to, const guard<double, D, Orders>& from,
                       int n, int i) {
    for (int m = 0; m <= lane_orders; ++m) {
        for (int j = 0; j < n; ++j)
            set_lane(to.rows[m][j], i, from.rows[m][j]);
        set_lane(to.gains[m], i, from.gains[m]);
    }
    for (int g = 0; g < grids; ++g)
        fill_preview(to.ahead[g], from.ahead[g], n, i);
    fill_preview(to.expansion, from.expansion, n, i);
    set_lane(to.lower, i, from.lower);
    set_lane(to.upper, i, from.upper);
    set_lane(to.reach, i, from.reach);
    to.closed = from.closed;
}

template <int N, int D, int K>
inline void fill_law(contact_law<pack<N>, D, K>& to, const contact_law<double, D, K>& from, int n,
                     int contacts, int i) {
    for (int j = 0; j < n; ++j)
        set_lane(to.impulse[j], i, from.impulse[j]);
    for (int k = 0; k < contacts; ++k)
        set_lane(to.mobility[k], i, from.mobility[k]);
    set_lane(to.effective_mass, i, from.effective_mass);
    set_lane(to.restitution_lower, i, from.restitution_lower);
    set_lane(to.restitution_upper, i, from.restitution_upper);
}

} // namespace detail

template <int N, class Shape>
inline void put_system(lanes<N, Shape>& to, int i,
                       const hybrid<modal_flow<double, Shape>>& system) {
    to.systems[i] = &system;
    to.lines = system.lines;
    const int n = system.dimension(), contacts = system.contacts();
    detail::fill_flow(to.free.flow, system.modes[0].flow, i);
    for (int k = 0; k < contacts; ++k) {
        detail::fill_guard(to.free.guards[k], system.modes[0].guards[k], n, i);
        detail::fill_law(to.laws[k], system.laws[k], n, contacts, i);
    }
    for (int l = 0; l < system.lines; ++l)
        set_lane(to.inverse_omega_squared[l], i, system.inverse_omega_squared[l]);
}

template <int N, class Shape>
inline void put_trajectory(lane_trajectories<N, Shape>& to, int i,
                           const trajectory<double, Shape>& t, int n, int contacts) {
    to.mode[i] = t.mode;
    to.held[i] = t.held;
    for (int j = 0; j < n; ++j)
        set_lane(to.at.y[j], i, t.y[j]);
    for (int k = 0; k < contacts; ++k) {
        set_lane(to.at.touching[k], i, t.touching[k]);
        set_lane(to.at.rate[k], i, t.rate[k]);
        set_lane(to.at.flat[k], i, t.flat[k]);
    }
}

template <int N, class Shape>
inline trajectory<double, Shape> take_trajectory(const lane_trajectories<N, Shape>& from, int i,
                                                 int n, int contacts) {
    trajectory<double, Shape> t{};
    t.mode = from.mode[i];
    t.held = from.held[i];
    for (int j = 0; j < n; ++j)
        t.y[j] = lane(from.at.y[j], i);
    for (int k = 0; k < contacts; ++k) {
        t.touching[k] = lane(from.at.touching[k], i);
        t.rate[k] = lane(from.at.rate[k], i);
        t.flat[k] = lane(from.at.flat[k], i);
    }
    return t;
}

// One event in every lane.
template <int N, class Shape>
inline lane_events<N, Shape> step(const lanes<N, Shape>& systems, lane_trajectories<N, Shape>& all,
                                  const pack<N>& horizon) {
    const int n = systems.free.flow.dimension(), contacts = systems.free.flow.contacts();
    auto end = quick_flight(systems.free, all.at, horizon);
    for (int i = 0; i < N; ++i)
        if (all.mode[i] != 0 || all.held[i] != 0) set_lane(end.proved, i, false);
    vec<pack<N>, Shape::max_dimension> before{};
    const auto after = quick_impact(systems.free, systems.laws, systems.lines,
                                    systems.inverse_omega_squared, end, all.at, before);
    lane_events<N, Shape> events{};
    for (int i = 0; i < N; ++i) {
        if (!lane(end.proved, i)) {
            auto t = take_trajectory(all, i, n, contacts);
            events.of[i] = certified_step(*systems.systems[i], t, lane(horizon, i));
            put_trajectory(all, i, t, n, contacts);
            continue;
        }
        auto& e = events.of[i];
        e = {status::impact,
             static_cast<int>(lane(end.contact, i)),
             static_cast<int>(lane(end.side, i)),
             0,
             lane(end.duration, i),
             lane(end.rate, i),
             lane(after, i),
             {}};
        for (int j = 0; j < n; ++j)
            e.before[j] = lane(before[j], i);
    }
    return events;
}

} // namespace vi
