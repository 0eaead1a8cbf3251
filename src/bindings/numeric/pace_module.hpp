// The function pace of the module.
#pragma once

#include <nanobind/nanobind.h>

namespace binding {

void bind_pace(nanobind::module_& m);

} // namespace binding
