#include "ensemble/batch_lanes.hpp"

namespace binding {

void run_modal(const batch_run& b, interrupt_check interrupted) {
    run_in_lanes<vi::modal_flow<double, vi::any_size>>(b, interrupted);
}

} // namespace binding
