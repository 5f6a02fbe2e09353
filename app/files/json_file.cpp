#include "app/files/json_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/errors.h"

namespace mray::app {

void refuse_json(const std::string& place, const std::string& what, const char* command) {
    throw Error(ErrorKind::kBadInput,
                fmt::format("{}: {}; give a file that `{}` wrote", place, what, command));
}

std::string line_of(const std::string& file, const std::string& text, std::size_t byte) {
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(byte, text.size()));
    return fmt::format("{}:{}", escape(file), 1 + std::count(text.begin(), end, '\n'));
}

bool is_report_of(std::string_view command, const JsonAt& json) {
    const JsonAt member = json.at("command");
    return member.is_text() && member.text() == command;
}

}  // namespace mray::app
