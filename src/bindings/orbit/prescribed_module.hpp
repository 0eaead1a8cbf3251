// The class Prescribed of the module.
#pragma once

#include <nanobind/nanobind.h>

namespace binding {

void bind_prescribed(nanobind::module_& m);

} // namespace binding
