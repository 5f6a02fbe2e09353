// Problems that a user should know of although the work continues.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "common/base/errors.h"

namespace mray {

struct Warning {
    /// "file" or "file:line"; empty where there is no file.
    std::string place;
    std::string text;
    /// As Error::remedy().
    Remedy remedy = Remedy::kNone;
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

/// An error about `file` ("file: ..." or "file:line: ...") as a warning. A message about anything
/// else has no place.
inline Warning as_warning(const Error& error, std::string_view file) {
    const std::string_view message = error.what();
    const std::size_t colon =
        message.starts_with(file) ? message.find(": ", file.size()) : std::string_view::npos;
    if (colon == std::string_view::npos) return {{}, std::string(message), error.remedy()};
    return {std::string(message.substr(0, colon)), std::string(message.substr(colon + 2)),
            error.remedy()};
}

}  // namespace mray
