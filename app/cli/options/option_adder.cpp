#include "app/cli/options/option_adder.h"

#include <utility>

#include "common/base/errors.h"

namespace mray::app {
namespace {

/// The first long name in "-o,--out", or the name of a positional.
std::string shown_name(const std::string& names) {
    const std::size_t begin = names.find("--");
    if (begin == std::string::npos) return names;
    return names.substr(begin, names.find(',', begin) - begin);
}

}  // namespace

CLI::Option* OptionAdder::add(const char* name, const char* type, const std::string& help,
                              Setter set) const {
    const std::string option = shown_name(name);
    return command_
        .add_option_function<std::string>(
            name,
            [option, set = std::move(set)](const std::string& value) {
                if (value.empty()) {
                    throw Error(ErrorKind::kBadArgument, option + ": the value is empty");
                }
                set(option, value);
            },
            help)
        ->type_name(type);
}

CLI::Option* OptionAdder::add_text(const char* name, const char* type, const std::string& help,
                                   std::string& target) const {
    return add(name, type, help,
               [&target](const std::string&, const std::string& value) { target = value; });
}

void OptionAdder::add_flag(const char* name, const char* help, bool& target) const {
    command_.add_flag(name, target, help)->multi_option_policy(CLI::MultiOptionPolicy::Throw);
}

void OptionAdder::add_view(const char* name, const char* type, const char* help, Setter set) const {
    add(name, type, help,
        [&options = options_, set = std::move(set)](const std::string& option,
                                                    const std::string& value) {
            options.view_arguments.insert(options.view_arguments.end(), {option, value});
            set(option, value);
        });
}

}  // namespace mray::app
