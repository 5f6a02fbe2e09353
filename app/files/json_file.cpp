#include "app/files/json_file.h"

#include <fmt/format.h>

#include "common/base/errors.h"

namespace mray::app {

void refuse_json(const std::string& place, const std::string& what, const char* command) {
    throw Error(ErrorKind::kBadInput,
                fmt::format("{}: {}; give a file that `{}` wrote", place, what, command));
}

bool is_report_of(std::string_view command, const JsonAt& json) {
    const JsonAt member = json.at("command");
    return member.is_text() && member.text() == command;
}

}  // namespace mray::app
