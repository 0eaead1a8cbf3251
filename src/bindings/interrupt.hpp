// Ctrl-C, seen while the kernel runs without the interpreter lock.
#pragma once

#include <nanobind/nanobind.h>

namespace binding {

inline bool interrupted() {
    const nanobind::gil_scoped_acquire hold;
    return PyErr_Occurred() || PyErr_CheckSignals() != 0; // raised is raised
}

// What a thread asks while it runs, chosen while it holds the lock: Python handles signals in its main
// thread only, and any other would wait for the lock, for as long as other code of Python runs, in vain.
inline auto interrupted_here() {
    const auto main = nanobind::module_::import_("threading").attr("main_thread")();
    const bool here =
        nanobind::cast<unsigned long>(main.attr("ident")) == PyThread_get_thread_ident();
    return here ? interrupted : +[] { return false; };
}

inline void raise_if_interrupted() {
    if (PyErr_Occurred()) throw nanobind::python_error();
}

} // namespace binding
