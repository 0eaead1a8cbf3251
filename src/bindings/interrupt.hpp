// Ctrl-C, seen while the kernel runs without the interpreter lock.
#pragma once

#include <nanobind/nanobind.h>

namespace binding {

inline bool interrupted() {
    const nanobind::gil_scoped_acquire hold;
    return PyErr_CheckSignals() != 0;
}
inline void raise_if_interrupted() {
    if (PyErr_Occurred()) throw nanobind::python_error();
}

} // namespace binding
