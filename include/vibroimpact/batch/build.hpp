// The systems of a batch, built from arrays into memory that is lent: no heap, no library.
//
// Method      assemble.hpp, where the numbers of a system lie
// Assumes     arrays as _kernel.Batch checks them; a modal flow
// Accuracy    the bits of the bindings; modes that these build when they are first wanted are all
//             built beforehand here
#pragma once

#include "vibroimpact/assemble.hpp"
#include "vibroimpact/batch/arrays.hpp"
#include "vibroimpact/run.hpp"

namespace vi {

VI_HD inline mode_coordinates coordinates_of(const batch_arrays& b, long long mode, long long s) {
    const long long n = b.degrees, d = 2 * (n + b.lines), at = mode * b.systems + s;
    return {b.to_x + at * n * d,    b.to_v + at * n * d,   b.offset + at * n,
            b.from_x + at * d * n,  b.from_v + at * d * n, b.particular + at * d * 2 * b.lines,
            b.kappas + s * b.lines, static_cast<int>(n),   static_cast<int>(b.lines)};
}

// Typed views of the memory that is lent.
template <class Flow>
VI_HD inline mode<double, Flow>* modes_of(const batch_arrays& b, long long s) {
    return static_cast<mode<double, Flow>*>(b.built_modes) + s * b.modes;
}
template <class Flow>
VI_HD inline hybrid<Flow>& system_in(const batch_arrays& b, long long s) {
    return static_cast<hybrid<Flow>*>(b.built_systems)[s];
}

// Mode m of system s, with the maps to it and the rows that observers watch.
template <class Flow>
VI_HD inline void build_mode(const batch_arrays& b, long long m, long long s) {
    using map_type = typename hybrid<Flow>::map_type;
    using watched = guard<double, Flow::max_dimension>;
    auto& to = modes_of<Flow>(b, s)[m];
    auto& flow = to.flow;
    const int n = flow.dimension(), contacts = flow.contacts();
    const long long at = s * b.modes + m, half = (m * b.systems + s) * (n / 2);
    set_flow(flow, {b.steps[s], b.k + half, b.c + half, b.a + half, nullptr, nullptr});
    for (int i = 0; i < contacts; ++i) {
        const long long one = (m * b.systems + s) * contacts + i;
        set_guard(
            to.guards[i],
            {b.rows + one * n, b.gains[one], b.lower[one], b.upper[one], b.side[m * contacts + i]},
            flow);
    }
    const auto free = coordinates_of(b, 0, s), here = coordinates_of(b, m, s);
    constexpr int D = Flow::max_dimension;
    static_cast<map_type*>(b.built_from_free)[at] = map_between<D>(free, here, n);
    static_cast<map_type*>(b.built_to_free)[at] = map_between<D>(here, free, n);
    const auto watch_rows = [&](const double* rows, long long count, void* built) {
        for (long long r = 0; r < count; ++r)
            set_watched(static_cast<watched*>(built)[at * count + r], rows + r * b.degrees, here,
                        flow);
    };
    watch_rows(b.extremes_rows, b.extremes_count, b.built_extremes);
    watch_rows(b.averages_rows, b.averages_count, b.built_averages);
}

// What the modes of system s share. Its modes need not be there yet.
template <class Flow>
VI_HD inline void build_system(const batch_arrays& b, long long s) {
    using map_type = typename hybrid<Flow>::map_type;
    auto& h = system_in<Flow>(b, s);
    h.modes = modes_of<Flow>(b, s);
    h.from_free = static_cast<const map_type*>(b.built_from_free) + s * b.modes;
    h.to_free = static_cast<const map_type*>(b.built_to_free) + s * b.modes;
    h.codes = b.codes;
    h.mode_count = static_cast<int>(b.modes);
    set_lines(h, b.kappas + s * b.lines, static_cast<int>(b.lines));
    const int n = h.dimension(), contacts = h.contacts();
    for (int i = 0; i < contacts; ++i) {
        const long long at = s * contacts + i;
        set_law(h, i,
                {b.impulse + at * n, b.mobility + at * contacts, b.shift + at * n,
                 b.restitution + 2 * at});
    }
}

} // namespace vi
