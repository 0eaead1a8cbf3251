#include "ensemble/batch_of.hpp"

VI_STEPS(extern, binding::dense)

namespace binding {

void run_dense(const batch_run& b, interrupt_check interrupted) {
    run_alone<dense>(b, interrupted);
}

} // namespace binding
