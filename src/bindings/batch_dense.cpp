#include "batch_of.hpp"

namespace binding {

observed run_dense(const batch_data& batch, const members& all, const observer_options& options) {
    return run_alone<vi::dense_flow<double, vi::bounded<32, 8>>>(batch, all, options);
}

} // namespace binding
