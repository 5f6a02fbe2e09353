// Kinds of options, and groups of them that several commands have in common.
#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "app/base/choices.h"
#include "app/base/options.h"

namespace mray::app {

// All targets must outlive the parse.

/// An option whose value goes to set(option, value), which may throw Error.
template <class Set>
CLI::Option* add_value(CLI::App& command, const char* names, const std::string& value_name,
                       const std::string& help, Set set) {
    std::string shown = names;
    if (const std::size_t begin = shown.find("--"); begin != std::string::npos)
        shown = shown.substr(begin, shown.find(',', begin) - begin);
    const auto set_value = [shown, set](const std::string& value) {
        if (value.empty()) throw Error(ErrorKind::kBadArgument, shown + ": the value is empty");
        set(shown, value);
    };
    return command.add_option_function<std::string>(names, set_value, help)
        ->option_text(value_name);
}

CLI::Option* add_text(CLI::App& command, const char* names, const std::string& value_name,
                      const std::string& help, std::string& target);
CLI::Option* add_flag(CLI::App& command, const char* names, const std::string& help, bool& target);

/// An option with one of a few values.
template <class T, class Target>
CLI::Option* add_choice(CLI::App& command, const char* names, const std::string& help,
                        std::span<const Choice<T>> choices, Target& target) {
    return add_value(command, names, names_of<T>(choices), help,
                     [choices, &target](const std::string& option, const std::string& value) {
                         target = parse_choice<T>(option, value, choices);
                     });
}

template <class T>
T number_in(const T& target);
template <class T>
T number_in(const std::optional<T>& target);

/// A whole number in [lower, upper].
template <class Count>
CLI::Option* add_count(CLI::App& command, const char* names, const std::string& help, Count& target,
                       std::uint64_t lower, std::uint64_t upper) {
    return add_value(command, names, "N", help,
                     [=, &target](const std::string& option, const std::string& value) {
                         target = static_cast<decltype(number_in(target))>(
                             parse_count(option, value, lower, upper));
                     });
}

CLI::Option* add_scene(CLI::App& command, SourceOptions& source);
void add_source_options(CLI::App& command, SourceOptions& source);
void add_lenient(CLI::App& command, bool& target);
/// --frames; `otherwise` says which frames are the default.
void add_frames(CLI::App& command, std::string& target, const char* otherwise);
CLI::Option* add_frame(CLI::App& command, std::optional<double>& target);

/// Size, camera, light and ambient occlusion, with the defaults to show.
void add_view_options(CLI::App& command, ViewSpec& view, const char* size, std::uint64_t least_ao,
                      const char* ao);
/// --rays, of which the first kind is the default.
CLI::Option* add_rays(CLI::App& command, ViewSpec& view, const char* otherwise);

/// --backend with these choices and the default to show, device, threads and instruction set.
void add_backend_options(CLI::App& command, BackendOptions& backend,
                         std::span<const Choice<BackendChoice>> choices, const char* otherwise);
void add_threads(CLI::App& command, int& target);

void add_build_at(CLI::App& command, std::optional<double>& target);

CLI::Option* add_json(CLI::App& command, std::string& target);

}  // namespace mray::app
