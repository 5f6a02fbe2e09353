#include "scenes/sequence/frame_pattern.h"

#include <fmt/format.h>

#include <utility>

#include "common/base/errors.h"
#include "common/text/message_text.h"
#include "common/text/number_text.h"

namespace mray {
namespace {

constexpr std::size_t kMaxDigits = 9;

[[noreturn]] void refuse(const std::string& pattern, const char* what) {
    throw Error(ErrorKind::kBadArgument,
                fmt::format("pattern {}: {}; write one %d or %0Nd (N from 1 to 9) in the file "
                            "name, and %% for a percent sign",
                            in_quotes(pattern), what));
}

}  // namespace

FramePattern::FramePattern(const std::string& pattern) {
    const std::size_t name_at = pattern.rfind('/') + 1;  // npos + 1 is 0
    std::string text;
    bool numbered = false;
    for (std::size_t i = 0; i < pattern.size(); ++i) {
        if (i == name_at) folder_ = std::exchange(text, {});
        if (pattern[i] != '%') {
            text += pattern[i];
            continue;
        }
        const std::string_view rest = std::string_view(pattern).substr(i + 1);
        if (rest.starts_with('%')) {
            text += '%';
            ++i;
            continue;
        }
        const bool padded = rest.size() >= 3 && rest[0] == '0' && rest[1] >= '1' &&
                            rest[1] <= '9' && rest[2] == 'd';
        if (!padded && !rest.starts_with('d')) refuse(pattern, "unknown use of '%'");
        if (i < name_at) refuse(pattern, "frame number in a folder's name");
        if (numbered) refuse(pattern, "two frame numbers");
        numbered = true;
        width_ = padded ? static_cast<std::size_t>(rest[1] - '0') : 1;
        prefix_ = std::exchange(text, {});
        i += padded ? 3 : 1;
    }
    suffix_ = text;
    if (!numbered) refuse(pattern, "no frame number");
}

std::string FramePattern::file_name(std::uint64_t number) const {
    return fmt::format("{}{:0{}}{}", prefix_, number, width_, suffix_);
}

std::optional<std::uint64_t> FramePattern::number_of(std::string_view name) const {
    if (name.size() <= prefix_.size() + suffix_.size() || !name.starts_with(prefix_) ||
        !name.ends_with(suffix_)) {
        return std::nullopt;
    }
    const std::string_view digits =
        name.substr(prefix_.size(), name.size() - prefix_.size() - suffix_.size());
    if (digits.size() > kMaxDigits || digits[0] == '-') return std::nullopt;
    const auto number = parse_integer(digits);
    if (!number || file_name(static_cast<std::uint64_t>(*number)) != name) return std::nullopt;
    return static_cast<std::uint64_t>(*number);
}

}  // namespace mray
