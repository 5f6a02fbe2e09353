// Commands, kinds of options, and groups of options that several commands have in common.
#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "app/base/options.h"
#include "app/cli/command_line.h"
#include "common/base/errors.h"
#include "common/text/text.h"

namespace mray::app {

[[noreturn]] inline void refuse(const std::string& message) {
    throw Error(ErrorKind::kBadArgument, message);
}

/// The heading, in --help-all, of the options that are added from here on.
inline void heading(CLI::App& command, const char* text) { command.option_defaults()->group(text); }

// All targets must outlive the parse.

/// A text that is not empty.
CLI::Option* add_text(CLI::App& command, const char* names, const std::string& value_name,
                      const std::string& help, std::string& target);

/// An option whose value is parse(text), which may throw Error.
template <class Target, class Parse>
CLI::Option* add_parsed(CLI::App& command, const char* names, const std::string& value_name,
                        const std::string& help, Target& target, Parse parse) {
    const auto set = [names, parse, &target](const std::string& text) {
        try {
            target = parse(text);
        } catch (const Error& error) {
            throw CLI::ValidationError(names, error.what());
        }
    };
    return command.add_option_function<std::string>(names, set, help)->option_text(value_name);
}

template <class T, class Target>
CLI::Option* add_choice(CLI::App& command, const char* names, const std::string& help,
                        std::span<const Choice<T>> choices, Target& target) {
    return add_parsed(command, names, names_of<T>(choices), help, target,
                      [choices](const std::string& text) { return value_in<T>(choices, text); });
}

template <class Target>
CLI::Option* add_count(CLI::App& command, const char* names, const std::string& help,
                       Target& target, std::int64_t lower, std::int64_t upper) {
    return command.add_option(names, target, help)
        ->option_text("N")
        ->check(CLI::Range(lower, upper));
}

/// Two whole numbers of at least `lower`, with a separator between.
CLI::Option* add_pair(CLI::App& command, const char* name, const char* value_name,
                      const std::string& help, char separator, std::int64_t lower,
                      std::uint32_t& first, std::uint32_t& second);

/// Refuses names of files for an --out that names a folder; `advice` says what to give.
void refuse_file_name(const std::string& out, const char* advice);

/// A finite number of at least `lower`.
double parse_finite(const std::string& text, double lower);
double parse_frame(const std::string& text);

CLI::Option* add_scene(CLI::App& command, SourceOptions& source);
void add_source_options(CLI::App& command, SourceOptions& source);
void add_lenient(CLI::App& command, bool& target);
/// --frames; `otherwise` says which frames are the default.
void add_frames(CLI::App& command, std::string& target, const char* otherwise);
CLI::Option* add_frame(CLI::App& command, std::optional<double>& target);

/// Size, camera, light and ambient occlusion, with the defaults to show.
void add_view_options(CLI::App& command, morphray::View& view, const char* size,
                      std::uint32_t least_ao, const char* ao);
/// --rays, of which the first kind is the default.
CLI::Option* add_rays(CLI::App& command, morphray::View& view, const char* otherwise);

/// --backend with these choices and the default to show, device, threads and instruction set.
void add_backend_options(CLI::App& command, BackendOptions& backend,
                         std::span<const Choice<BackendChoice>> choices, const char* otherwise);

void add_build_at(CLI::App& command, std::optional<double>& target);

CLI::Option* add_json(CLI::App& command, std::string& target);

}  // namespace mray::app
