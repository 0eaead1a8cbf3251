#include "engine/system_of.hpp"

VI_STEPS(extern, binding::dense)

namespace binding {

std::unique_ptr<system> make_dense(const system_data& data) {
    return std::make_unique<system_of<dense>>(data);
}

} // namespace binding
