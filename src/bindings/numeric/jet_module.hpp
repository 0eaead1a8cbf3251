// The class Jet of the module: a number with three directions of differentiation.
#pragma once

#include <nanobind/nanobind.h>

namespace binding {

void bind_jet(nanobind::module_& m);

} // namespace binding
