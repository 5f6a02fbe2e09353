#include "app/terminal/failure.h"

#include <fmt/format.h>

#include <new>
#include <stdexcept>

#include "app/base/remedy_text.h"
#include "app/terminal/interrupt.h"
#include "common/base/errors.h"
#include "common/base/thread_errors.h"

namespace mray::app {

Failure describe_failure(const std::exception_ptr& failure) {
    std::string internal;
    try {
        std::rethrow_exception(failure);
    } catch (const Error& error) {
        return {message_of(error), error.kind() == ErrorKind::kCancelled
                                       ? interrupt_exit_code()
                                       : exit_code_of(error.kind())};
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
