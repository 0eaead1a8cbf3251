#include "ensemble/batch_lanes.hpp"

namespace binding {

void run_modal_small_mixed(const batch_run& b, interrupt_check interrupted) {
    run_in_lanes<vi::modal_flow<double, vi::fixed<6, 1, 1, true>>>(b, interrupted);
}

} // namespace binding
