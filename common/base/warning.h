// What a user should know although the work goes on.
#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace morphray {

struct Warning {
    /// "file" or "file:line"; empty where there is no file.
    std::string place;
    std::string text;

    /// "place: warning: text", or "warning: text".
    std::string line() const { return (place.empty() ? "" : place + ": ") + "warning: " + text; }
};

using WarnFunction = std::function<void(const Warning&)>;

/// What an Error about `file` says ("file: ..." or "file:line: ..."), as a warning. A message about
/// anything else has no place.
inline Warning as_warning(std::string_view message, std::string_view file) {
    if (!message.starts_with(file)) return {{}, std::string(message)};
    const std::size_t colon = message.find(": ", file.size());
    if (colon == std::string_view::npos) return {{}, std::string(message)};
    return {std::string(message.substr(0, colon)), std::string(message.substr(colon + 2))};
}

}  // namespace morphray
