#include "batch_lanes.hpp"

namespace binding {

observed run_modal(const batch_data& batch, const members& all, const observer_options& options) {
    return run_in_lanes<vi::modal_flow<double, vi::bounded<32, 8>>>(batch, all, options);
}

} // namespace binding
