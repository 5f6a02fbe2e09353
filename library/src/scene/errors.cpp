#include "library/src/scene/errors.h"

#include <cstddef>
#include <exception>
#include <iterator>
#include <new>

#include "common/base/errors.h"

namespace morphray {
namespace {

// Up to here both name the same kinds in one order.
static_assert(static_cast<int>(ErrorCode::device_lost) ==
              static_cast<int>(mray::ErrorKind::kDeviceLost));

ErrorCode code_of(mray::ErrorKind kind) {
    if (kind == mray::ErrorKind::kCancelled) return ErrorCode::cancelled;
    if (kind == mray::ErrorKind::kInternal) return ErrorCode::internal;
    return static_cast<ErrorCode>(kind);
}

constexpr const char* kNames[] = {"bad_argument", "bad_input", "unavailable", "output",   "limit",
                                  "device_lost",  "busy",      "internal",    "cancelled"};
static_assert(std::size(kNames) == static_cast<std::size_t>(ErrorCode::cancelled) + 1);

// Made while there is memory: a copy takes none.
const Error kNoMemory(ErrorCode::limit, mray::kOutOfMemory);

}  // namespace

const char* to_string(ErrorCode code) noexcept {
    const auto number = static_cast<std::size_t>(code);
    return number < std::size(kNames) ? kNames[number] : "internal";
}

Error::Error(ErrorCode code, const std::string& message)
    : std::runtime_error(message), code_(code) {}
Error::~Error() = default;

namespace detail {

void rethrow_as_public() {
    try {
        try {
            throw;
        } catch (const Error&) {
            throw;
        } catch (const std::bad_alloc&) {
            throw;
        } catch (const mray::Error& error) {
            throw Error(code_of(error.kind()), error.what());
        } catch (const std::length_error&) {
            throw Error(ErrorCode::limit,
                        "something is larger than memory can be; choose a smaller scene or image");
        } catch (const std::exception& error) {
            if (mray::is_out_of_threads(error)) throw Error(ErrorCode::limit, mray::kOutOfThreads);
            throw Error(ErrorCode::internal, error.what());
        }
    } catch (const std::bad_alloc&) {
        // The text of another error may have thrown it.
        throw kNoMemory;
    }
}

}  // namespace detail
}  // namespace morphray
