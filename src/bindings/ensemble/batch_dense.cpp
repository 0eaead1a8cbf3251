#include "ensemble/batch_of.hpp"
#include "vibroimpact/flow/dense.hpp"

namespace binding {

void run_dense(const batch_run& b, interrupt_check interrupted) {
    run_alone<vi::dense_flow<double, vi::any_size>>(b, interrupted);
}

} // namespace binding
