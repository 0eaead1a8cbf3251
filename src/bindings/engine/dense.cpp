#include "engine/system_of.hpp"

namespace binding {

std::unique_ptr<system> make_dense(const system_data& data) {
    return std::make_unique<system_of<vi::dense_flow<double, vi::any_size>>>(data);
}

} // namespace binding
