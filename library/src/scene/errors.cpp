#include "library/src/scene/errors.h"

#include <exception>
#include <new>
#include <stdexcept>

#include "common/base/errors.h"

namespace morphray {
namespace {

ErrorCode code_of(mray::ErrorKind kind) {
    using mray::ErrorKind;
    switch (kind) {
        case ErrorKind::kBadArgument:
            return ErrorCode::bad_argument;
        case ErrorKind::kBadInput:
            return ErrorCode::bad_input;
        case ErrorKind::kUnavailable:
            return ErrorCode::unavailable;
        case ErrorKind::kOutput:
            return ErrorCode::output;
        case ErrorKind::kLimit:
            return ErrorCode::limit;
        case ErrorKind::kDeviceLost:
            return ErrorCode::device_lost;
        case ErrorKind::kCancelled:
            return ErrorCode::cancelled;
        default:
            return ErrorCode::internal;
    }
}

}  // namespace

const char* to_string(ErrorCode code) noexcept {
    switch (code) {
        case ErrorCode::bad_argument:
            return "bad_argument";
        case ErrorCode::bad_input:
            return "bad_input";
        case ErrorCode::unavailable:
            return "unavailable";
        case ErrorCode::output:
            return "output";
        case ErrorCode::limit:
            return "limit";
        case ErrorCode::device_lost:
            return "device_lost";
        case ErrorCode::busy:
            return "busy";
        case ErrorCode::cancelled:
            return "cancelled";
        default:
            return "internal";
    }
}

Error::Error(ErrorCode code, const std::string& message)
    : std::runtime_error(message), code_(code) {}
Error::~Error() = default;

namespace detail {
namespace {

// Made while there is memory: a copy takes none.
const Error kNoMemory(ErrorCode::limit,
                      "out of memory; choose a smaller scene or image, or raise the limit");

[[noreturn]] void rethrow_translated() {
    try {
        throw;
    } catch (const Error&) {
        throw;
    } catch (const mray::Error& error) {
        throw Error(code_of(error.kind()), error.what());
    } catch (const std::bad_alloc&) {
        throw kNoMemory;
    } catch (const std::length_error&) {
        throw Error(ErrorCode::limit,
                    "something is larger than memory can be; choose a smaller scene or image");
    } catch (const std::exception& error) {
        throw Error(ErrorCode::internal, error.what());
    }
}

}  // namespace

void rethrow_as_public() {
    try {
        rethrow_translated();
    } catch (const std::bad_alloc&) {
        // There was no memory for the text of an error.
        throw kNoMemory;
    }
}

void throw_bad_argument(const std::string& message) {
    throw Error(ErrorCode::bad_argument, message);
}

}  // namespace detail
}  // namespace morphray
