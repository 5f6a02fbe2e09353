#include "app/cli/usage_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/errors.h"
#include "common/text/nearest_name.h"

namespace mray::app {
namespace {

[[noreturn]] void fail(const std::string& what) { throw Error(ErrorKind::kBadArgument, what); }

std::string help_of(const std::string& command) {
    return command.empty() ? "morphray --help" : fmt::format("morphray {} --help", command);
}

std::string advice(const std::string& similar, const std::string& command) {
    return similar.empty() ? fmt::format("see `{}`", help_of(command))
                           : fmt::format("did you mean {}?", similar);
}

[[noreturn]] void reject_option(const std::string& given, const FailedParse& parse) {
    // All options begin with dashes, so dashes must not count as similarity.
    const std::string dashed = given.substr(0, given.find('='));
    const std::string name = dashed.substr(std::min(dashed.find_first_not_of('-'), dashed.size()));
    const auto& program = parse.program_options;
    if (!parse.command.empty() &&
        std::find(program.begin(), program.end(), name) != program.end()) {
        fail(fmt::format("unknown option '{}'; did you mean `morphray --{}`?", given, name));
    }
    const std::string similar = similar_name(name, parse.options);
    fail(fmt::format("unknown option '{}'; {}", given,
                     advice(similar.empty() ? "" : "--" + similar, parse.command)));
}

}  // namespace

void reject_command(const std::string& given, std::vector<std::string> commands) {
    commands.emplace_back("help");
    fail(fmt::format("unknown command '{}'; {}", given, advice(similar_name(given, commands), "")));
}

void explain(const FailedParse& parse) {
    const std::string help = help_of(parse.command);
    if (parse.arguments.empty()) {
        fail(fmt::format("no command; choose one of {}, or see `{}`",
                         fmt::join(parse.commands, ", "), help));
    }
    if (parse.command.empty() && !parse.arguments.front().starts_with('-')) {
        reject_command(parse.arguments.front(), parse.commands);
    }
    // The value of an unknown option may have been taken for something else.
    const auto unknown = std::ranges::find_if(
        parse.extras, [](const std::string& extra) { return extra.starts_with('-'); });
    if (unknown != parse.extras.end()) reject_option(*unknown, parse);
    if (parse.times > 1) {
        fail(fmt::format("{}: given {} times; give it once", parse.repeated, parse.times));
    }
    if (!parse.extras.empty())
        fail(fmt::format("unexpected argument '{}'; see `{}`", parse.extras.front(), help));
    fail(fmt::format("{}; see `{}`", parse.message, help));
}

}  // namespace mray::app
