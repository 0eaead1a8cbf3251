#include "ensemble/batch_of.hpp"

VI_STEPS(extern, binding::dense_small)

namespace binding {

void run_dense_small(const batch_run& b, interrupt_check interrupted) {
    run_alone<dense_small>(b, interrupted);
}

} // namespace binding
