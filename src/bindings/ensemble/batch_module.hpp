// The class Batch of the module.
#pragma once

#include <nanobind/nanobind.h>

namespace binding {

void bind_batch(nanobind::module_& m);

} // namespace binding
