#include "tests/fuzz/targets/outcome.h"

#include <fmt/format.h>

#include <algorithm>

namespace mray::fuzz {
namespace {

// A path of 4096 bytes, all of them escaped, and some text.
constexpr std::size_t kLongestMessage = 20000;

bool is_control(char c) { return (c >= 0 && c < ' ') || c == '\x7f'; }

}  // namespace

std::string message_failure(std::string_view message, std::string_view name) {
    if (message.size() > kLongestMessage)
        return fmt::format("a message of {} bytes", message.size());
    if (std::any_of(message.begin(), message.end(), is_control))
        return fmt::format("a message of several lines or with control characters: {}", message);
    if (message.find(name) == std::string_view::npos)
        return fmt::format("an error that does not name the file: {}", message);
    return {};
}

std::string error_failure(const Error& error, std::string_view name) {
    if (error.kind() != ErrorKind::kBadInput && error.kind() != ErrorKind::kLimit)
        return fmt::format("error of another kind: {}", error.what());
    return message_failure(error.what(), name);
}

}  // namespace mray::fuzz
