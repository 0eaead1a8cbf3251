#include "engine/system_of.hpp"

VI_STEPS(extern, binding::dense_small)

namespace binding {

std::unique_ptr<system> make_dense_small(const system_data& data) {
    return std::make_unique<system_of<dense_small>>(data);
}

} // namespace binding
