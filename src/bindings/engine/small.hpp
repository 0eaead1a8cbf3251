// Small flows without blocks: their states are copied, and their modes built, in a fraction of the time.
#pragma once

#include <cstddef>

namespace binding {

inline constexpr int small_dimension = 8, small_contacts = 2, small_elements = 2;

inline bool is_small(std::size_t dimension, std::size_t contacts, std::size_t elements) {
    return dimension <= small_dimension && contacts <= small_contacts && elements <= small_elements;
}

} // namespace binding
