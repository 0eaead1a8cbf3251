// The systems of a batch, built from arrays into memory that is lent: no heap, no library.
//
// Method      as src/bindings/system_of.hpp and physical_map.hpp, operation for operation
// Assumes     arrays as _kernel.Batch checks them; a modal flow
// Accuracy    the bits of the bindings; modes that these build when they are first wanted are all
//             built beforehand here
#pragma once

#include "vibroimpact/batch/arrays.hpp"
#include "vibroimpact/mode_coordinates.hpp"
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

namespace detail {

VI_HD inline void copy(double* to, const double* from, long long count) {
    for (long long i = 0; i < count; ++i)
        to[i] = from[i];
}

VI_HD inline double finite_part(double x) {
    return abs(x) < infinity() ? abs(x) : 0.0;
}

template <class Flow>
VI_HD inline void build_guard(const batch_arrays& b, long long m, long long s, int i,
                              mode<double, Flow>& to) {
    const int contacts = to.flow.contacts(), n = to.flow.dimension();
    const long long at = (m * b.systems + s) * contacts + i;
    auto& g = to.guards[i];
    copy(g.rows[0].x, b.rows + at * n, n);
    g.gains[0] = b.gains[at];
    g.lower = b.lower[at];
    g.upper = b.upper[at];
    g.closed = b.side[m * contacts + i];
    g.reach = max(finite_part(g.lower), finite_part(g.upper));
    differentiate(g, to.flow);
}

// Rows on the coordinates as rows on y of a mode: `count` of them, watched by an observer.
template <class Flow>
VI_HD inline void build_watched(const double* rows, long long count, const mode_coordinates& from,
                                const Flow& flow, guard<double, Flow::max_dimension>* to) {
    const int n = flow.dimension(), degrees = from.degrees;
    for (long long r = 0; r < count; ++r) {
        auto& g = to[r];
        g = {};
        for (int i = 0; i < degrees; ++i) {
            const double factor = rows[r * degrees + i];
            for (int j = 0; j < n; ++j)
                g.rows[0][j] += factor * from.to_x[i * n + j];
            g.gains[0] += factor * from.offset[i];
        }
        differentiate(g, flow);
    }
}

template <class Flow>
VI_HD inline void build_laws(const batch_arrays& b, long long s, hybrid<Flow>& h) {
    const int n = h.dimension(), contacts = h.contacts();
    for (int i = 0; i < contacts; ++i) {
        const long long at = s * contacts + i;
        auto& law = h.laws[i];
        copy(law.impulse.x, b.impulse + at * n, n);
        copy(law.mobility, b.mobility + at * contacts, contacts);
        law.effective_mass = 1.0 / law.mobility[i];
        copy(law.shift.x, b.shift + at * n, n);
        law.restitution_lower = b.restitution[2 * at];
        law.restitution_upper = b.restitution[2 * at + 1];
    }
}

} // namespace detail

// Mode m of system s, with the maps to it and the rows that observers watch.
template <class Flow>
VI_HD inline void build_mode(const batch_arrays& b, long long m, long long s) {
    using map_type = typename hybrid<Flow>::map_type;
    using watched = guard<double, Flow::max_dimension>;
    auto& to = modes_of<Flow>(b, s)[m];
    auto& flow = to.flow;
    const int n = flow.dimension();
    const long long at = s * b.modes + m, half = (m * b.systems + s) * (n / 2);
    flow.step = b.steps[s];
    detail::copy(flow.k.x, b.k + half, n / 2);
    detail::copy(flow.c.x, b.c + half, n / 2);
    detail::copy(flow.a.x, b.a + half, n / 2);
    flow.prepare();
    for (int i = 0; i < flow.contacts(); ++i)
        detail::build_guard(b, m, s, i, to);
    const auto free = coordinates_of(b, 0, s), here = coordinates_of(b, m, s);
    constexpr int D = Flow::max_dimension;
    static_cast<map_type*>(b.built_from_free)[at] = map_between<D>(free, here, n);
    static_cast<map_type*>(b.built_to_free)[at] = map_between<D>(here, free, n);
    detail::build_watched(b.extremes_rows, b.extremes_count, here, flow,
                          static_cast<watched*>(b.built_extremes) + at * b.extremes_count);
    detail::build_watched(b.averages_rows, b.averages_count, here, flow,
                          static_cast<watched*>(b.built_averages) + at * b.averages_count);
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
    for (int l = 0; l < h.lines(); ++l) {
        const double kappa = b.kappas[s * b.lines + l];
        h.inverse_omega_squared[l] = 1.0 / (kappa * kappa);
    }
    detail::build_laws(b, s, h);
}

} // namespace vi
