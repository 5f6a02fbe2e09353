#include "app/terminal/failure.h"

#include <fmt/format.h>

#include <new>
#include <stdexcept>
#include <string_view>

#include "app/base/remedy_text.h"
#include "app/terminal/interrupt.h"
#include "common/base/errors.h"
#include "common/base/thread_errors.h"
#include "common/base/watch.h"

namespace mray::app {

Failure describe_failure(const std::exception_ptr& failure) {
    std::string internal;
    try {
        std::rethrow_exception(failure);
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kCancelled)
            return {message_of(error), exit_code_of(error.kind())};
        // Work that was given the flag of the signal does not know of signals.
        return {error.what() == std::string_view(kWorkCancelled) ? interrupt_message()
                                                                 : message_of(error),
                interrupt_exit_code()};
    } catch (const std::bad_alloc&) {
        return {"out of memory; choose a smaller scene or image, or raise the limit",
                ExitCode::kLimit};
    } catch (const std::length_error&) {
        return {"something is larger than memory can be; choose a smaller scene or image",
                ExitCode::kLimit};
    } catch (const std::exception& error) {
        if (is_lack_of_threads(error)) {
            return {"no more threads can be started; use --threads 1 or raise the limit",
                    ExitCode::kLimit};
        }
        internal = error.what();
    } catch (...) {
        internal = "unknown exception";
    }
    return {fmt::format("internal error: {}; please report it", internal), ExitCode::kInternal};
}

}  // namespace mray::app
