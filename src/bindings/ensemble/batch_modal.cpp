#include "ensemble/batch_lanes.hpp"

VI_STEPS(extern, binding::modal)

namespace binding {

void run_modal(const batch_run& b, interrupt_check interrupted) {
    run_in_lanes<modal>(b, interrupted);
}

} // namespace binding
