// The systems of a batch, built from arrays into borrowed memory: no heap, no library.
//
// Method      assemble.hpp, with the numbers where arrays.hpp says
// Assumes     arrays as _kernel.Batch checks them
#pragma once

#include "vibroimpact/ensemble/arrays.hpp"
#include "vibroimpact/system/assemble.hpp"

namespace vi {

// Memory of one system: mode m, its maps and the rows watched in it have place m.
template <class Flow>
struct system_room {
    using map_type = typename hybrid<Flow>::map_type;
    using watched = guard<double, Flow::max_dimension>;
    hybrid<Flow>* system;
    mode<double, Flow>* modes;
    map_type *from_free, *to_free, *resets;
    watched* rows;       // of all observers, those of a mode together
    long long row_count; // of a mode
};

template <class Shape>
VI_HD inline sizes<Shape> sizes_of(const batch_arrays& b) {
    return {static_cast<int>(2 * (b.degrees + b.lines)), static_cast<int>(b.lines),
            static_cast<int>(b.contacts), b.mixed != 0};
}

VI_HD inline mode_coordinates coordinates_of(const batch_arrays& b, long long mode, long long s) {
    const long long n = b.degrees, d = 2 * (n + b.lines), at = mode * b.systems + s;
    return {b.to_x + at * n * d,       b.to_v + at * n * d,
            b.offset + at * n,         b.from_x + at * d * n,
            b.from_v + at * d * n,     b.particular + at * d * 2 * b.lines,
            b.kappas + s * b.lines,    static_cast<int>(n),
            static_cast<int>(b.lines), b.map_shift ? b.map_shift + at * d : nullptr};
}

template <class Flow>
VI_HD inline flow_numbers flow_of(const batch_arrays& b, long long mode, long long s) {
    const long long d = 2 * (b.degrees + b.lines), at = mode * b.systems + s, half = at * (d / 2);
    flow_numbers from{b.steps[s]};
    if constexpr (is_modal<Flow>) {
        from.k = b.k + half;
        from.c = b.c + half;
        from.a = b.a + half;
    } else {
        from.b = b.b + at * d * d;
        from.constant = b.constant + at * d;
        if (b.mode_steps) from.step = b.mode_steps[at];
        if (b.norm) from.norm = b.norm + at * d * d;
        if (b.growth) from.growth = b.growth + at;
    }
    return from;
}

// The watches of mode m of system s.
template <class Flow>
VI_HD inline void build_watches(const batch_arrays& b, long long m, long long s,
                                mode<double, Flow>& to) {
    if (!b.watch_counts) return;
    long long first = 0;
    for (long long k = 0; k < m; ++k)
        first += b.watch_counts[k];
    const int count = b.watch_counts[m], n = to.flow.dimension();
    for (int j = 0; j < count; ++j) {
        const long long at = first * b.systems + s * count + j;
        add_watch(to, {{b.watch_rows + at * n, b.watch_gains[at], b.watch_lower[at],
                        b.watch_upper[at], no_side},
                       b.watch_element[first + j],
                       b.watch_held[first + j] != 0,
                       b.watch_reset[first + j],
                       b.watch_target ? b.watch_target[first + j] : -1});
    }
}

// Mode m of system s, with the maps to it and the rows that observers watch.
template <class Flow>
VI_HD inline void build_mode(const batch_arrays& b, long long m, long long s,
                             const system_room<Flow>& room) {
    constexpr int D = Flow::max_dimension;
    auto& to = room.modes[m];
    auto& flow = to.flow;
    begin_mode(to);
    static_cast<sizes<typename Flow::shape_type>&>(flow) = sizes_of<typename Flow::shape_type>(b);
    set_flow(flow, flow_of<Flow>(b, m, s));
    const int n = flow.dimension(), contacts = flow.contacts();
    for (int i = 0; i < contacts; ++i) {
        const long long at = (m * b.systems + s) * contacts + i;
        set_guard(
            to.guards[i],
            {b.rows + at * n, b.gains[at], b.lower[at], b.upper[at], b.side[m * contacts + i]},
            flow);
    }
    build_watches(b, m, s, to);
    prepare_search(to, m == 0);
    const auto free = coordinates_of(b, 0, s), here = coordinates_of(b, m, s);
    if (b.codes[m] % room.system->closed_sets() == 0) set_terms(*room.system, to, here);
    room.from_free[m] = map_between<D>(free, here, n);
    room.to_free[m] = map_between<D>(here, free, n);
    auto* row = room.rows + m * room.row_count;
    b.observers.each_wanted([&](const auto& one) {
        if constexpr (requires { one.rows; })
            for (long long r = 0; r < one.rows.count; ++r)
                set_observed_row(*row++, one.rows.numbers + 3 * r * b.degrees, here, flow);
    });
}

// Builds what the modes of system s share; they need not be there yet.
template <class Flow>
VI_HD inline void build_system(const batch_arrays& b, long long s, const system_room<Flow>& room) {
    auto& h = *room.system;
    static_cast<sizes<typename Flow::shape_type>&>(h) = sizes_of<typename Flow::shape_type>(b);
    h.modes = room.modes;
    h.from_free = room.from_free;
    h.to_free = room.to_free;
    h.resets = room.resets;
    h.together = b.together;
    h.codes = b.codes;
    h.mode_count = static_cast<int>(b.modes);
    set_lines(h, b.kappas + s * b.lines, static_cast<int>(b.lines));
    if constexpr (Flow::shape_type::max_elements > 0) {
        h.elements.count = static_cast<int>(b.elements);
        h.elements.given = b.given;
        for (int e = 0; e < h.elements.count; ++e) {
            h.elements.states[e] = b.states[e];
            h.elements.soft[e] = b.soft[e] != 0;
            h.elements.joint[e] = b.joint[e] != 0;
        }
    }
    const int n = h.dimension(), contacts = h.contacts();
    for (long long r = 0; r < b.resets; ++r) {
        auto& to = room.resets[r];
        to = {};
        for (int i = 0; i < n; ++i)
            to.matrix[i][i] = 1.0;
        for (int i = 0; i < n && b.reset_matrix; ++i)
            detail::copy(to.matrix[i].x, b.reset_matrix + ((s * b.resets + r) * n + i) * n, n);
        detail::copy(to.shift.x, b.reset_shift + (s * b.resets + r) * n, n);
    }
    for (int i = 0; i < contacts; ++i) {
        const long long at = s * contacts + i;
        set_law(h, i,
                {b.impulse + at * n, b.mobility + at * contacts, b.shift + at * n,
                 b.restitution + 2 * at});
    }
}

} // namespace vi
