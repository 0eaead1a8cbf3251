// One member of a batch from its start to its row of results: the work of one thread of a device.
//
// Method      as run_alone of src/bindings/batch_of.hpp, operation for operation
// Assumes     build_system and build_mode have built its system; a shape fixed<D, C> of exactly the
//             sizes of the batch
// Accuracy    the bits of the bindings
// Fails       member_end; a closed set of contacts without a mode ends as `missing`
#pragma once

#include "vibroimpact/batch/results.hpp"
#include "vibroimpact/start.hpp"

namespace vi {

// Bytes of one entry of the memory that batch_arrays lends, in the order of its fields: systems,
// modes, maps, watched rows, section points, impacts kept for settling; then of batch_arrays.
inline constexpr int entry_kinds = 7;
template <class Flow>
VI_HD inline void sizes_of_entries(long long* out) {
    using Shape = typename Flow::shape_type;
    const long long sizes[entry_kinds] = {sizeof(hybrid<Flow>),
                                          sizeof(mode<double, Flow>),
                                          sizeof(typename hybrid<Flow>::map_type),
                                          sizeof(guard<double, Flow::max_dimension>),
                                          sizeof(section_point<Shape>),
                                          sizeof(kept_impact<Shape>),
                                          sizeof(batch_arrays)};
    for (int i = 0; i < entry_kinds; ++i)
        out[i] = sizes[i];
}

namespace detail {

// The start of member i, in the free mode.
template <class Flow>
VI_CALL trajectory<double, typename Flow::shape_type>
start_of(const batch_arrays& b, const hybrid<Flow>& system, long long i) {
    const long long first = i * b.degrees;
    return start_at(system, coordinates_of(b, 0, b.system[i]), b.position + first,
                    b.velocity + first, b.phases + i * b.lines);
}

// Options, and memory of member i, for its observers.
template <class Flow>
VI_HD inline void prepare_observers(const batch_arrays& b, long long i, double settle,
                                    observers<Flow>& all) {
    using Shape = typename Flow::shape_type;
    using watched = guard<double, Flow::max_dimension>;
    const long long s = b.system[i];
    const double omega = b.lines ? b.omegas[s * b.lines] : 0.0;
    const physical_rows physical{coordinates_of(b, 0, s), b.lines ? omega : 1.0 / b.steps[s]};
    all.wanted = static_cast<unsigned>(b.wanted);
    all.settle = settle;
    all.section.contact = static_cast<int>(b.contact);
    all.section.side = static_cast<int>(b.stop);
    all.section.last = static_cast<long>(b.last);
    all.section.stride = static_cast<long>(b.stride);
    all.section.points = static_cast<section_point<Shape>*>(b.points) + i * b.last;
    all.symbol.tolerance = b.symbol_tolerance;
    all.symbol.returns = static_cast<long>(b.symbol_returns);
    all.settling.orbit.tolerance = b.settling_tolerance;
    all.settling.orbit.returns = static_cast<long>(b.settling_returns);
    all.settling.longest = static_cast<long>(b.longest);
    all.settling.kept = static_cast<kept_impact<Shape>*>(b.kept) + i * b.longest;
    all.symbol.rows = all.settling.orbit.rows = physical;
    all.symbol.omega = all.settling.orbit.omega = omega;
    const auto of_system = [&](void* built, long long count) {
        return watched_rows<Flow>{static_cast<const watched*>(built) + s * b.modes * count,
                                  static_cast<int>(count)};
    };
    all.extremes.watched = of_system(b.built_extremes, b.extremes_count);
    all.averages.watched = of_system(b.built_averages, b.averages_count);
}

} // namespace detail

// Run member i; `Tangents` vectors are carried along where exponents are wanted, 0 for none.
template <class Flow, int Tangents>
VI_HD inline void run_member(const batch_arrays& b, long long i) {
    const auto& system = system_in<Flow>(b, b.system[i]);
    const member_rows<Flow> rows(b, i);
    rows.clear();
    const auto start = detail::start_of(b, system, i);
    if (behind_stop(system, start)) {
        b.end[i] = static_cast<signed char>(member_end::behind_stop);
        return;
    }
    member<double, Flow> m{start};
    const window w{b.settle[i], b.observe[i], static_cast<long>(b.most_impacts)};
    observers<Flow> all{};
    detail::prepare_observers(b, i, w.settle, all);
    all.depart(m.at);

    no_more_modes none;
    const double begin = Tangents > 0 ? begin_of_tangents(w) : infinity();
    const run_end why = begin > 0.0 ? run_until(system, m, w, all, begin, none) : run_end::observer;
    member_end end = end_of_member(why);
    growth<(Tangents > 0 ? Tangents : 1)> tangents;
    if constexpr (Tangents > 0) {
        tangents.count = static_cast<int>(b.exponents);
        if (why == run_end::observer) end = finish_with_tangents(system, m, w, all, tangents, none);
    }

    const double time = m.so_far.now.time(), omega = all.symbol.omega;
    b.time[i] = time;
    rows.write(all, omega > 0.0 ? 2.0 * pi / omega : not_a_number(), time - w.settle);
    rows.write(tangents);
    rows.write_final(m.at);
    if constexpr ((observers_compiled & sees_settling) != 0)
        if (all.wants(sees_settling))
            b.settling[i] = settling_time(system, start, w, all.settling, m.so_far.impacts, none);
    b.end[i] = static_cast<signed char>(end);
}

} // namespace vi
