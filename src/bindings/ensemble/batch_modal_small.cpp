#include "ensemble/batch_lanes.hpp"

VI_STEPS(extern, binding::modal_small)

namespace binding {

void run_modal_small(const batch_run& b, interrupt_check interrupted) {
    run_in_lanes<modal_small>(b, interrupted);
}

} // namespace binding
