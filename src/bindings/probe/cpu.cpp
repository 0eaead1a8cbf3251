// vibroimpact._cpu: what the processor runs, asked before any of the kernel's modules is loaded.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "targets.hpp"

NB_MODULE(_cpu, m) {
    m.def("supported", &supported_targets,
          "Instruction sets of this processor that the kernel is built for, best first.");
}
