// Python can make an object of a class without calling its constructor, by __new__.
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstring>
#include <new>
#include <string>

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

template <class Class>
std::string name_of(const Class& object_class) {
    return object_class.attr("__name__").template cast<std::string>();
}

/// For classes without a constructor: no object comes from Python.
template <class Class>
void forbid_new(Class& object_class) {
    const auto refuse = [name = name_of(object_class)](const py::args&,
                                                       const py::kwargs&) -> py::object {
        throw py::type_error(name + ": objects are made by other calls of morphray");
    };
    object_class.attr("__new__") = py::cpp_function(refuse);
    object_class.attr("__init__") =
        py::cpp_function(refuse, py::name("__init__"), py::is_method(object_class),
                         "__init__(self)\n--\n\nObjects are made by other calls.");
}

/// Lets pickling and copying raise TypeError, which ends with what to do `instead`. Without this,
/// protocols 0 and 1 end the process: they call the base class of pybind11, which then throws
/// through the interpreter.
template <class Class>
void forbid_pickling(Class& object_class, const std::string& instead) {
    const std::string message = name_of(object_class) + ": cannot be pickled or copied; " + instead;
    for (const char* const method : {"__reduce__", "__reduce_ex__"}) {
        object_class.attr(method) = py::cpp_function(
            [message](const py::object&, const py::args&) -> py::object {
                throw py::type_error(message);
            },
            py::name(method), py::is_method(object_class));
    }
}

}  // namespace morphray::python
