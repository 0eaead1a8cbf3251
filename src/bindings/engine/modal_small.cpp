#include "engine/system_of.hpp"

namespace binding {

std::unique_ptr<system> make_modal_small(const system_data& data) {
    return std::make_unique<system_of<vi::modal_flow<double, vi::fixed<6, 1, 1>>>>(data);
}

} // namespace binding
