// One member of a batch from its start to its row of results: the work of one thread of a device.
//
// Assumes     build_system and build_mode have built its system, all modes of the batch; a shape
//             fixed<D, C> of exactly the sizes of the batch
// Accuracy    the bits of other hosts
// Fails       member_end; a closed set of contacts without a mode ends as `missing`
#pragma once

#include "vibroimpact/ensemble/member.hpp"

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

// Run member i; `Tangents` vectors are carried along where exponents are wanted, 0 for none.
template <class Flow, int Tangents>
VI_HD inline void run_member(const batch_arrays& b, long long i) {
    const auto built = room_of_system<Flow>(b, b.system[i]);
    const auto& system = *built.system;
    passage<Flow> here{};
    if (!board(b, i, built, room_of_member<Flow>(b, i), here)) return;

    no_more_modes none;
    const double begin = Tangents > 0 ? begin_of_tangents(here.window) : infinity();
    const run_end why = begin > 0.0
                            ? run_until(system, here.now, here.window, here.observers, begin, none)
                            : run_end::observer;
    member_end end = end_of_member(why);
    growth<(Tangents > 0 ? Tangents : 1)> tangents;
    if constexpr (Tangents > 0) {
        tangents.count = static_cast<int>(b.exponents);
        if (why == run_end::observer)
            end =
                finish_with_tangents(system, here.now, here.window, here.observers, tangents, none);
    }
    leave(b, i, system, here, end, tangents, none);
}

} // namespace vi
