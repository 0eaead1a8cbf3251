#include "ensemble/batch_lanes.hpp"

VI_STEPS(extern, binding::dense_small)

namespace binding {

namespace {

// Guards of the mode that has most.
int most_guards(const vi::batch_arrays& b) {
    int most = 0;
    for (long long m = 0; m < b.modes; ++m)
        most = std::max(most, b.watch_counts[m]);
    return most + static_cast<int>(b.contacts);
}

} // namespace

void run_dense_small(const batch_run& b, interrupt_check interrupted) {
    const auto& arrays = b.arrays;
    if (arrays.elements == 0 || !arrays.watch_counts || arrays.modes > vi::most_lane_modes)
        return run_alone<dense_small>(b, interrupted);
    using one_body = vi::guarded<4, 1, 4, true>; // and one line
    if (arrays.degrees == 1 && arrays.lines == 1 && most_guards(arrays) <= 4)
        return run_in_modes<dense_small, one_body>(b, interrupted);
    run_in_modes<dense_small, vi::guarded_of<dense_small::shape_type>>(b, interrupted);
}

} // namespace binding
