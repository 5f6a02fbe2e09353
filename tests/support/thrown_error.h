// The errors that calls throw.
#pragma once

#include <optional>
#include <string>

#include "common/base/errors.h"
#include "tests/support/text.h"

namespace mray::test {

/// The Error that a call throws, if it does.
template <class Call>
std::optional<Error> error_of(const Call& call) {
    try {
        call();
    } catch (const Error& error) {
        return error;
    }
    return std::nullopt;
}

template <class Call>
std::optional<ErrorKind> kind_of(const Call& call) {
    const auto error = error_of(call);
    return error ? std::optional(error->kind()) : std::nullopt;
}

/// The text of the Error that a call throws; empty if it throws none.
template <class Call>
std::string message_of(const Call& call) {
    const auto error = error_of(call);
    return error ? error->what() : "";
}

}  // namespace mray::test
