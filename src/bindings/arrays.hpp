// Numbers between Python and C++.
#pragma once

#include <utility>
#include <vector>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

namespace binding {

namespace nb = nanobind;

using array = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;

inline std::vector<double> numbers_of(const array& a) {
    return {a.data(), a.data() + a.size()};
}

// Hand a vector to numpy without copying it again.
template <class T>
nb::object to_numpy(std::vector<T> values, std::vector<std::size_t> shape) {
    auto* kept = new std::vector<T>(std::move(values));
    nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
    return nb::cast(nb::ndarray<nb::numpy, T>(kept->data(), shape.size(), shape.data(), owner));
}

} // namespace binding
