// Errors that an argument, a file or a device causes. A broken invariant of the code is an assert.
#pragma once

#include <fmt/core.h>

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace mray {

enum class ErrorKind {
    kBadArgument,  // of a call or of the command line
    kBadInput,     // a file or array that cannot be used
    kUnavailable,  // a backend or device that cannot be had
    kOutput,       // a file that cannot be written
    kLimit,        // more memory, threads or device resources than there are
    kDeviceLost,   // the device stopped answering
    kCancelled,    // the caller asked the work to end
    kInternal,     // a broken invariant that was detected
};

/// A setting under which the work would have succeeded. Each caller has its own name for it.
enum class Hint {
    kNone,
    kLenient,         // AnimationOptions::lenient
    kReplaceMissing,  // AnimationOptions::skip_missing
};

/// what() is one line, `file:line: what is wrong; what to do` where there is a file and a line.
class Error : public std::runtime_error {
public:
    Error(ErrorKind kind, const std::string& message, Hint hint = Hint::kNone)
        : std::runtime_error(message), kind_(kind), hint_(hint) {}
    template <class... Values>
    Error(ErrorKind kind, fmt::format_string<Values...> text, Values&&... values)
        : Error(kind, fmt::format(text, std::forward<Values>(values)...)) {}
    ErrorKind kind() const { return kind_; }
    Hint hint() const { return hint_; }

private:
    ErrorKind kind_;
    Hint hint_;
};

inline constexpr const char* kOutOfMemory =
    "out of memory; choose a smaller scene or image, or raise the limit";
inline constexpr const char* kOutOfThreads =
    "no more threads can be started; ask for fewer, or raise the limit";

/// Whether the system starts no more threads, which oneTBB says in its text alone.
inline bool is_out_of_threads(const std::exception& error) {
    return std::string_view(error.what()).ends_with(std::generic_category().message(EAGAIN));
}

struct Warning {
    /// "file" or "file:line"; empty where there is no file.
    std::string place;
    std::string text;
    Hint hint = Hint::kNone;
    /// Further warnings of this kind, which this one stands for.
    std::uint64_t more = 0;

    /// "place: warning: text (and 3 more)", without what is empty or 0. `advice` follows the text.
    std::string line(std::string_view advice = {}) const {
        std::string line = place.empty() ? "" : place + ": ";
        line.append("warning: ").append(text).append(advice);
        if (more > 0) line += " (and " + std::to_string(more) + " more)";
        return line;
    }
};

using WarnFunction = std::function<void(const Warning&)>;

/// An error as a warning, whose place is empty unless the message begins with `file`.
inline Warning as_warning(const Error& error, std::string_view file) {
    const std::string_view message = error.what();
    const std::size_t colon =
        message.starts_with(file) ? message.find(": ", file.size()) : std::string_view::npos;
    if (colon == std::string_view::npos) return {{}, std::string(message), error.hint()};
    return {std::string(message.substr(0, colon)), std::string(message.substr(colon + 2)),
            error.hint()};
}

}  // namespace mray
