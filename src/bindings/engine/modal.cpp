#include "engine/system_of.hpp"

VI_STEPS(extern, binding::modal)

namespace binding {

std::unique_ptr<system> make_modal(const system_data& data) {
    return std::make_unique<system_of<modal>>(data);
}

} // namespace binding
