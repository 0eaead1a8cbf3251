#include "batch_lanes.hpp"

namespace binding {

void run_modal(const vi::batch_arrays& b, question ask) {
    run_in_lanes<vi::modal_flow<double, vi::bounded<32, 8>>>(b, ask);
}

} // namespace binding
