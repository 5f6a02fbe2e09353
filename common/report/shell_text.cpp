#include "common/report/shell_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "common/text/text_parts.h"

namespace mray {

std::string shell_quoted(const std::string& argument) {
    constexpr const char* kPlain =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:,@%";
    if (!argument.empty() && argument.find_first_not_of(kPlain) == std::string::npos) {
        return argument;
    }
    std::string quoted(1, '\'');
    for (const char c : argument) {
        if (c == '\'') {
            quoted.append("'\\''");
        } else {
            quoted.push_back(c);
        }
    }
    quoted.push_back('\'');
    return quoted;
}

namespace {

bool is_printable(const std::string& argument) {
    return utf8_text(argument) == argument &&
           std::ranges::none_of(argument, [](unsigned char c) { return c < 0x20 || c == 0x7F; });
}

/// As the argument of bash's $'...': the text without what may be special there.
std::string ansi_quoted(const std::string& argument) {
    std::string quoted = "$'";
    for (std::size_t i = 0; i < argument.size();) {
        const std::size_t length = utf8_length(std::string_view(argument).substr(i));
        const auto byte = static_cast<unsigned char>(argument[i]);
        if (length == 0 || byte < 0x20 || byte == 0x7F) {
            // \xNN takes two digits at most, so that digits may follow.
            quoted += fmt::format("\\x{:02X}", byte);
        } else {
            if (byte == '\'' || byte == '\\') quoted += '\\';
            quoted += argument.substr(i, length);
        }
        i += std::max<std::size_t>(1, length);
    }
    return quoted + "'";
}

}  // namespace

std::string shell_line(std::span<const std::string> arguments) {
    std::string line;
    for (const std::string& argument : arguments) {
        if (!line.empty()) line.push_back(' ');
        line.append(is_printable(argument) ? shell_quoted(argument) : ansi_quoted(argument));
    }
    return line;
}

}  // namespace mray
