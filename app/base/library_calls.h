// Calls of the library by the program.
#pragma once

#include <utility>

#include "common/base/errors.h"
#include "morphray/error.hpp"

namespace mray::app {

/// The kind of error that has the exit code of this one.
ErrorKind kind_of(morphray::ErrorCode code);

/// Calls `work`; an error of the library comes out as one of the program.
template <class Work>
decltype(auto) call_library(Work&& work) {
    try {
        return std::forward<Work>(work)();
    } catch (const morphray::Error& error) {
        throw Error(kind_of(error.code()), error.what());
    }
}

}  // namespace mray::app
