#include "app/cli/options/option_adder.h"

#include <utility>

#include "common/base/errors.h"

namespace mray::app {

OptionSpec& OptionAdder::add(const char* names, const std::string& value_name,
                             const std::string& help, Setter set) const {
    return command_.options.emplace_back(OptionSpec{names, value_name, help, std::move(set)});
}

OptionSpec& OptionAdder::add_text(const char* names, const char* value_name,
                                  const std::string& help, std::string& target) const {
    return add(names, value_name, help,
               [&target](const std::string&, const std::string& value) { target = value; });
}

void OptionAdder::add_flag(const char* names, const char* help, bool& target) const {
    command_.options.push_back({names, "", help, &target});
}

void OptionAdder::add_arguments(const char* name, const char* value_name, const char* help,
                                ValueList list) const {
    command_.options.push_back({name, value_name, help, list, true});
}

OptionSpec& OptionAdder::added(std::string_view names) const {
    for (OptionSpec& option : command_.options)
        if (option.names == names) return option;
    throw Error(ErrorKind::kInternal, "no such option");
}

void OptionAdder::add_view(const char* names, const char* value_name, const char* help,
                           Setter set) const {
    add(names, value_name, help,
        [&options = options_, set = std::move(set)](const std::string& option,
                                                    const std::string& value) {
            options.view_arguments.insert(options.view_arguments.end(), {option, value});
            set(option, value);
        });
}

}  // namespace mray::app
