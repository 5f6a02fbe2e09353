// Gives up the GIL while C++ works.
#pragma once

#include <pybind11/pybind11.h>
#include <unistd.h>

namespace morphray::python {

/// Without the GIL from construction to destruction. In place of py::gil_scoped_release, which ends
/// the process if the interpreter ends while a daemon thread works: Python before 3.14 ends such a
/// thread where it asks for the GIL, by unwinding its stack. Here the thread waits for the end of
/// the process, as in Python 3.14.
class GilRelease {
public:
    GilRelease() : state_(PyEval_SaveThread()) {}
    ~GilRelease() {
        try {
            PyEval_RestoreThread(state_);
        } catch (...) {
            // Leaving this block would go on with the unwinding.
            while (true) pause();
        }
    }
    GilRelease(const GilRelease&) = delete;

private:
    PyThreadState* state_;
};

}  // namespace morphray::python
