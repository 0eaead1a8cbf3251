// Ctrl-C, seen while the kernel runs without the interpreter lock.
#pragma once

#include <atomic>

#include <nanobind/nanobind.h>

namespace binding {

// Ends the runs of all threads that obey it, once it is set.
class stop_sign {
public:
    void set() { up_ = true; }
    bool is_set() const { return up_; }

private:
    std::atomic<bool> up_ = false;
};

// Sign that this thread obeys; whoever started it keeps the sign until it has ended.
inline thread_local const stop_sign* obeyed = nullptr;

inline bool interrupted() {
    const nanobind::gil_scoped_acquire hold;
    return PyErr_Occurred() || PyErr_CheckSignals() != 0; // raised is raised
}

// Question that a thread asks while it runs, chosen while it holds the lock: Python handles signals in its main
// thread only, and any other would wait for the lock, for as long as other code of Python runs, in vain.
// Those ask their sign.
inline auto interrupted_here() {
    const auto main = nanobind::module_::import_("threading").attr("main_thread")();
    const bool here =
        nanobind::cast<unsigned long>(main.attr("ident")) == PyThread_get_thread_ident();
    return here ? interrupted : +[] { return obeyed && obeyed->is_set(); };
}

inline void raise_if_interrupted() {
    if (PyErr_Occurred()) throw nanobind::python_error();
}

} // namespace binding
