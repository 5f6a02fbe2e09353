// Calls that give up the GIL while C++ works, and what ends them: Ctrl-C and morphray.Cancel.
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <vector>

namespace morphray::python {

namespace py = pybind11;

/// Unlike py::gil_scoped_release, does not end the process if the interpreter ends while a daemon
/// thread works: Python before 3.14 unwinds such a thread's stack. Here it waits for the end.
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

/// Ends the calls that it has been given to. The GIL, which all members need, guards it.
class Cancel {
public:
    void set() {
        is_set_ = true;
        for (std::atomic<bool>* const call : calls_) *call = true;
    }
    void clear() { is_set_ = false; }
    bool is_set() const { return is_set_; }

    /// While it lives, set() makes `cancel` true.
    class Use {
    public:
        Use(Cancel* owner, std::atomic<bool>& cancel) : owner_(owner), cancel_(cancel) {
            if (owner_ == nullptr) return;
            owner_->calls_.push_back(&cancel_);
            if (owner_->is_set_) cancel_ = true;
        }
        ~Use() {
            if (owner_ != nullptr) std::erase(owner_->calls_, &cancel_);
        }
        Use(const Use&) = delete;

    private:
        Cancel* owner_;
        std::atomic<bool>& cancel_;
    };

private:
    bool is_set_ = false;
    std::vector<std::atomic<bool>*> calls_;
};

}  // namespace morphray::python
