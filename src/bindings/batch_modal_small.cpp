#include "batch_lanes.hpp"

namespace binding {

observed run_modal_small(const batch_data& batch, const members& all,
                         const observer_options& options) {
    return run_in_lanes<vi::modal_flow<double, vi::fixed<6, 1, 1>>>(batch, all, options);
}

} // namespace binding
