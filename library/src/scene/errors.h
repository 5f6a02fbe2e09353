// Turns the errors of the code behind the library into those of the public interface.
#pragma once

#include <fmt/core.h>

#include <utility>

#include "morphray/error.hpp"

namespace morphray::detail {

/// Throws the exception that is being handled again, as an Error of the public interface.
[[noreturn]] void rethrow_as_public();

/// Calls `work`; whatever it throws comes out as a public Error.
template <class Work>
decltype(auto) with_public_errors(Work&& work) {
    try {
        return std::forward<Work>(work)();
    } catch (...) {
        rethrow_as_public();
    }
}

template <class... Values>
[[noreturn]] void throw_error(ErrorCode code, fmt::format_string<Values...> text,
                              Values&&... values) {
    throw Error(code, fmt::format(text, std::forward<Values>(values)...));
}
template <class... Values>
[[noreturn]] void throw_bad_argument(fmt::format_string<Values...> text, Values&&... values) {
    throw_error(ErrorCode::bad_argument, text, std::forward<Values>(values)...);
}

}  // namespace morphray::detail
