// Python can make an object of a class without calling its constructor, by __new__.
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstring>
#include <new>

namespace morphray::python {

namespace py = pybind11;

/// For classes with a constructor: pybind11 takes the memory of an object that was not initialised
/// from here, so that what is in it can be recognised by its zeros.
struct ZeroFilled {
    static void* operator new(std::size_t size) {
        return std::memset(::operator new(size), 0, size);
    }
    static void operator delete(void* memory) { ::operator delete(memory); }
    // For objects in memory that is there already.
    static void* operator new(std::size_t, void* memory) { return memory; }
};

/// For classes without a constructor: no object comes from Python.
template <class Class>
void forbid_new(Class& object_class) {
    const auto name = object_class.attr("__name__").template cast<std::string>();
    object_class.attr("__new__") =
        py::cpp_function([name](const py::args&, const py::kwargs&) -> py::object {
            throw py::type_error(name + ": objects are made by other calls of morphray");
        });
}

}  // namespace morphray::python
