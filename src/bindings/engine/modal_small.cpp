#include "engine/system_of.hpp"

VI_STEPS(extern, binding::modal_small)

namespace binding {

std::unique_ptr<system> make_modal_small(const system_data& data) {
    return std::make_unique<system_of<modal_small>>(data);
}

} // namespace binding
