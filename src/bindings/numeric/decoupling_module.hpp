// The function decouple of the module.
#pragma once

#include <nanobind/nanobind.h>

namespace binding {

void bind_decoupling(nanobind::module_& m);

} // namespace binding
