// What the sources of the module share: calls without the GIL, and keyword arguments.
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "morphray/images.hpp"
#include "morphray/scene.hpp"

namespace morphray::python {

namespace py = pybind11;

class PyScene;

/// Unlike py::gil_scoped_release, does not end the process if the interpreter ends while a daemon
/// thread works: Python before 3.14 unwinds its stack. Here the thread waits for the end.
class GilRelease {
public:
    GilRelease() : state_(PyEval_SaveThread()) {}
    ~GilRelease() {
        try {
            PyEval_RestoreThread(state_);
        } catch (...) {
            // Leaving this block would end the process.
            while (true) pause();
        }
    }
    GilRelease(const GilRelease&) = delete;

private:
    PyThreadState* state_;
};

/// Ends the calls that have it. The GIL guards it.
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

void bind_scene(py::module_& module);
void bind_queries(py::class_<PyScene>& scene_class);

/// Throws TypeError "`wanted` is needed, not ..." for what is no Value.
template <class Value>
Value value_of(const py::object& object, const char* wanted) {
    try {
        return object.cast<Value>();
    } catch (const py::cast_error&) {
        const std::string text = std::string(wanted) + " is needed, not ";
        throw py::type_error(text + std::string(py::repr(object)).substr(0, 60));
    }
}

[[noreturn]] void throw_choice(const std::string& argument, const std::string& value,
                               const std::string& choices);
int find_choice(const std::string& argument, const py::object& value,
                std::initializer_list<const char*> names);
/// The value of an enumeration whose names are given in order. Throws ValueError for another one.
template <class Value>
Value choice(const std::string& argument, const py::object& value,
             std::initializer_list<const char*> names) {
    return static_cast<Value>(find_choice(argument, value, names));
}

}  // namespace morphray::python
