#include "engine/system_of.hpp"

namespace binding {

std::unique_ptr<system> make_modal(const system_data& data) {
    return std::make_unique<system_of<vi::modal_flow<double, vi::any_size>>>(data);
}

} // namespace binding
