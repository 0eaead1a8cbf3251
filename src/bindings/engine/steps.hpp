// Flows that have systems and batches. What both want of the engine is compiled once, in engine/steps_*.cpp:
// VI_STEPS(, flow) there, VI_STEPS(extern, flow) where it is called.
#pragma once

#include "engine/small.hpp"
#include "vibroimpact/engine/engine.hpp"
#include "vibroimpact/flow/dense.hpp"
#include "vibroimpact/numeric/jet.hpp"

namespace binding {

using modal = vi::modal_flow<double, vi::any_size>;
using modal_small = vi::modal_flow<double, vi::fixed<6, 1, 1>>; // an oscillator or two, one contact
using dense = vi::dense_flow<double, vi::any_elements>;
using dense_small =
    vi::dense_flow<double,
                   vi::shape<small_dimension, 0, small_contacts, false, false, small_elements>>;

template <class Flow>
inline constexpr int most_exponents = Flow::max_dimension - 1;

// Tangents that a system carries at once; columns of Jacobians go in blocks of so many. A batch of small
// ones carries as many, so that both take the same steps.
template <class Flow>
inline constexpr int tangent_width = most_exponents<Flow> < 8 ? most_exponents<Flow> : 6;
template <class Flow>
using tangents_of = vi::jet<double, tangent_width<Flow>>;
using one_tangent = vi::jet<double, 1>;

} // namespace binding

#define VI_STEPS_OF(KEY, T, FLOW)                                                                  \
    KEY template vi::event<T, FLOW::shape_type> vi::detail::fly_to_event<T, FLOW>(                 \
        const vi::hybrid<FLOW>&, vi::trajectory<T, FLOW::shape_type>&, double,                     \
        vi::flight_memory<FLOW>&, bool (*)());                                                     \
    KEY template vi::event<T, FLOW::shape_type> vi::certified_step<T, FLOW>(                       \
        const vi::hybrid<FLOW>&, vi::trajectory<T, FLOW::shape_type>&, double, bool, int);         \
    KEY template vi::event<T, FLOW::shape_type> vi::micro_bounce_step<T, FLOW>(                    \
        const vi::hybrid<FLOW>&, vi::trajectory<T, FLOW::shape_type>&, double);

// A number, one tangent, and as many as a system carries.
#define VI_STEPS(KEY, FLOW)                                                                        \
    VI_STEPS_OF(KEY, double, FLOW)                                                                 \
    VI_STEPS_OF(KEY, binding::one_tangent, FLOW)                                                   \
    VI_STEPS_OF(KEY, binding::tangents_of<FLOW>, FLOW)
