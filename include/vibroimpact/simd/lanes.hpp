// Several trajectories side by side, one per SIMD lane, each with a system of its own.
//
// Method      All lanes fly a round at a time (search/grid/quick_flight.hpp), those that have landed with
//             the impact that ends their flight. Packs of lanes take turns at its stages: the results
//             of one are on their way while another is worked on. A lane that a round cannot bring
//             on, or that is at rest on a stop, is left to the scalar certified step. Both are what
//             the scalar engine does with that trajectory, operation for operation: equal bits.
//             T is a pack, or a jet of packs for trajectories with tangents; systems are packs of
//             reals for both.
// Assumes     the free modes of all lanes have the same sizes
#pragma once

#include "vibroimpact/engine/engine.hpp"
#include "vibroimpact/numeric/pack.hpp"

namespace vi {

inline constexpr int lane_orders = 1; // derivatives of u that the quick flight reads as rows

// An element of an array whose elements are worked on in turn. It takes an odd number of cache lines, so that
// the same members of several elements do not fall on the same few sets of the nearest cache.
template <class T>
struct alignas(64) spaced : T {
    char apart[64 * ((sizeof(T) / 64 + 1) | 1) - sizeof(T)];
};

// The table entry of every lane at its place.
template <int N, class Entry>
VI_HOT table_rows<N, Entry> rows_at(const Entry* const (&entry)[N], const pack<N>& place) {
    table_rows<N, Entry> rows;
    places_of(entry, place, rows.of);
    return rows;
}

// Numbers at, at + 1 of the table entry of every lane.
template <int N, class Entry>
VI_HOT two<pack<N>> pick_two(const table_rows<N, Entry>& rows, int at) {
    const double* from[N];
    for (int i = 0; i < N; ++i)
        from[i] = rows.of[i]->x + at;
    two<pack<N>> out;
    zip_pairs(from, out.first, out.second);
    return out;
}

// The first four numbers of it.
template <int N, class Entry>
VI_HOT void pick_four(const table_rows<N, Entry>& rows, two<pack<N>>& a, two<pack<N>>& b) {
    const double* from[N];
    for (int i = 0; i < N; ++i)
        from[i] = rows.of[i]->x;
    zip_fours(from, a.first, a.second, b.first, b.second);
}

template <int N, class Shape>
struct lane_systems {
    using real = pack<N>;
    using flow = modal_flow<real, Shape>;
    static constexpr int D = Shape::max_dimension;
    static constexpr int K = Shape::max_contacts;

    mode<real, flow, lane_orders> free;
    contact_law<real, D, K> laws[K];
    real inverse_omega_squared[max_lines];
};

// Positions of the lanes: in a flight that began `flown` and so many applications ago, or just after an event.
template <class T, class Shape>
struct lane_states {
    static constexpr int N = scalar_traits<T>::lanes;

    trajectory<T, Shape> at;
    T flown;
    real_t<T> applications;
    mask_t<T> quick; // lanes in free flight, which a round may bring on
    flight_memory<modal_flow<real_t<T>, Shape>> memory;
    int mode[N] = {}, held[N] = {};
};

namespace detail {

template <int N, class Shape>
inline void fill_flow(modal_flow<pack<N>, Shape>& to, const modal_flow<double, Shape>& from,
                      int i) {
    static_cast<sizes<Shape>&>(to) = from;
    set_lane(to.step, i, from.step);
    set_lane(to.per_unit, i, from.per_unit);
    to.pushed = to.pushed | from.pushed;
    for (int g = 0; g < grids; ++g) {
        set_lane(to.spacing[g], i, from.spacing[g]);
        set_lane(to.grid_error[g], i, from.grid_error[g]);
    }
    set_lane(to.scan_length, i, from.scan_length);
    for (int j = 0; j < from.blocks(); ++j) {
        to.bends[j] = to.bends[j] | from.bends[j];
        set_lane(to.k[j], i, from.k[j]);
        set_lane(to.c[j], i, from.c[j]);
        set_lane(to.a[j], i, from.a[j]);
        set_lane(to.growth[j], i, from.growth[j]);
    }
    to.ahead.entry[i] = from.ahead.entry;
    for (int j = 0; j < from.oscillators(); ++j)
        for (int m = 0; m < nearby_order / 2; ++m)
            for (int n = 0; n < 4; ++n)
                set_lane(to.series[j].terms[m][n], i, from.series[j].terms[m][n]);
}

// The first n numbers of a row; the system may have room for more.
template <int N, int D, int E>
inline void fill_row(vec<pack<N>, D>& to, const vec<double, E>& from, int n, int i) {
    for (int j = 0; j < n; ++j)
        set_lane(to[j], i, from[j]);
}

template <int N, int D, int E>
inline void fill_rows(rows_ahead<pack<N>, D>& to, const rows_ahead<double, E>& from, int n, int i) {
    for (int k = 0; k < from.count; ++k) {
        for (int j = 0; j < n; ++j)
            set_lane(to.rows[j][k], i, from.rows[j][k]);
        set_lane(to.gains[k], i, from.gains[k]);
    }
    to.shifted = to.shifted | from.shifted;
}

template <int N, int D, int Orders>
inline void fill_guard(guard<pack<N>, D, lane_orders>& to, const guard<double, D, Orders>& from,
                       int n, int i) {
    for (int m = 0; m <= lane_orders; ++m) {
        fill_row(to.rows[m], from.rows[m], n, i);
        set_lane(to.gains[m], i, from.gains[m]);
    }
    for (int grid = 0; grid < grids; ++grid)
        fill_rows(to.ahead[grid], from.ahead[grid], n, i);
    fill_row(to.third, from.third, n, i);
    fill_row(to.fourth, from.fourth, n, i);
    fill_row(to.weights, from.weights, n, i);
    fill_row(to.third_push, from.third_push, n / 2, i);
    fill_row(to.fourth_push, from.fourth_push, n / 2, i);
    set_lane(to.least_terms, i, from.least_terms);
    set_lane(to.least_fourth, i, from.least_fourth);
    set_lane(to.least_sixth, i, from.least_sixth);
    set_lane(to.lower, i, from.lower);
    set_lane(to.upper, i, from.upper);
    set_lane(to.reach, i, from.reach);
    to.closed = from.closed;
}

template <int N, int D, int K>
inline void fill_law(contact_law<pack<N>, D, K>& to, const contact_law<double, D, K>& from, int n,
                     int i) {
    fill_row(to.impulse, from.impulse, n, i);
    set_lane(to.effective_mass, i, from.effective_mass);
    set_lane(to.restitution_lower, i, from.restitution_lower);
    set_lane(to.restitution_upper, i, from.restitution_upper);
}

} // namespace detail

template <int N, class Shape>
inline void put_system(lane_systems<N, Shape>& to, int i,
                       const hybrid<modal_flow<double, Shape>>& system) {
    const int n = system.dimension();
    detail::fill_flow(to.free.flow, system.modes[0].flow, i);
    for (int k = 0; k < system.contacts(); ++k) {
        detail::fill_guard(to.free.guards[k], system.modes[0].guards[k], n, i);
        detail::fill_law(to.laws[k], system.laws[k], n, i);
    }
    for (int l = 0; l < system.lines(); ++l)
        set_lane(to.inverse_omega_squared[l], i, system.inverse_omega_squared[l]);
}

// Trajectories of lanes: in a flight, or where one began.
template <class T, class Shape>
struct lane_trajectories {
    trajectory<T, Shape> at;
    int mode[scalar_traits<T>::lanes] = {}, held[scalar_traits<T>::lanes] = {};
};

template <class Lanes, class S, class Shape>
inline void put_state(Lanes& to, int i, const trajectory<S, Shape>& t, int n, int contacts) {
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

template <class T, class Shape>
inline void put_trajectory(lane_states<T, Shape>& to, int i, const trajectory<lane_t<T>, Shape>& t,
                           int n, int contacts) {
    to.memory.forget(i);
    set_lane(to.quick, i, t.mode == 0 && t.held == 0);
    set_lane(to.flown, i, 0.0);
    set_lane(to.applications, i, 0.0);
    put_state(to, i, t, n, contacts);
}

// Lane i of x, or its value alone where S is double: not that of value(x), which copies the pack.
template <class S, class T>
inline S take_lane(const T& x, int i) {
    if constexpr (is_same<S, double>)
        return value(lane(x, i));
    else
        return lane(x, i);
}

// In place: a copy would wait until all these numbers are written.
template <class Lanes, class S, class Shape>
inline void take_trajectory(const Lanes& from, int i, int n, int contacts,
                            trajectory<S, Shape>& t) {
    t.mode = from.mode[i];
    t.held = from.held[i];
    for (int j = 0; j < n; ++j)
        t.y[j] = take_lane<S>(from.at.y[j], i);
    for (int k = 0; k < contacts; ++k) {
        t.touching[k] = lane(from.at.touching[k], i);
        t.rate[k] = take_lane<S>(from.at.rate[k], i);
        t.flat[k] = lane(from.at.flat[k], i);
    }
}

// A round of all lanes, in the stages of quick_round. Lanes that landed have suffered the impact that
// ends their flight; lanes that are stuck wait for the certified step.
template <class T, class Shape>
struct lane_flight {
    static constexpr int N = scalar_traits<T>::lanes;
    using real = real_t<T>;
    using state = vec<T, Shape::max_dimension>;
    lane_systems<N, Shape> systems{};
    lane_states<T, Shape> all{};
    pack_mask<N> stuck;

    quick_round<T, mode<real, modal_flow<real, Shape>, lane_orders>, Shape> round{
        systems.free, all.at, all.flown, all.memory};

    VI_HOT const auto& flow() const { return systems.free.flow; }

    // The first stage, for lanes that are `going`; `horizon` is what is left of the time of each.
    VI_HOT void begin(const real& horizon, const pack_mask<N>& going) {
        round.begin(going & all.quick & may_go_on(flow(), value(all.flown), horizon));
    }
    // After the last one; `before` as impact_of_round() says.
    VI_HOT void impacts(const pack_mask<N>& going, quick_landing<T>& end, state& before) {
        if (round.repeats())
            finish<true>(going, end, before);
        else
            finish<false>(going, end, before);
    }

private:
    template <bool Some>
    VI_HOT void finish(const pack_mask<N>& going, quick_landing<T>& end, state& before) {
        state y;
        round.template land<Some>(end, y);
        stuck = going & !end.landed & !end.moved;
        if constexpr (Some) stuck &= !round.failed_recall(end);
        all.flown = select(end.landed, T(0.0), end.duration);
        if (!Some ||
            round.scans()) { // flights as recalled begin on their stop, with none, and land
            const real more = plus_where(end.moved, all.applications, real(applications_of_round));
            all.applications = only(!end.landed, more);
        }
        flow().each_contact([&](auto k) VI_WITHIN {
            all.at.touching[k] = select(end.moved, real(0.0), all.at.touching[k]);
        });
        impact_of_round(systems.free, systems.laws, systems.inverse_omega_squared, end, y, all.at,
                        before);
    }
};

} // namespace vi
