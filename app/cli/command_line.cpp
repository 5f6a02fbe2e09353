#include "app/cli/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <functional>
#include <sstream>
#include <utility>
#include <vector>

#include "app/cli/choices.h"
#include "app/cli/conflicts.h"
#include "app/cli/update_options.h"
#include "app/cli/usage_errors.h"
#include "common/base/errors.h"
#include "common/version.h"
#include "cpu/cpu_backend.h"

namespace morphray::app {
namespace {

// Defaults that several commands have in common; render's size is ViewSpec's.
constexpr const char* kFewFrames = "the first, those at a quarter and a half, the last";
constexpr const char* kFirstFrame = "the first; of several, the first is taken";
constexpr const char* kWholeImage = "1024x1024";
constexpr const char* kVulkanOrCpu = "auto: Vulkan where there is a GPU, else the CPU";

using Setter = std::function<void(const std::string& option, const std::string& value)>;

/// The subcommands with their options, each of which writes into one Options.
class CommandLine {
public:
    CommandLine() : app_("Ray tracer for triangle scenes that deform.", "morphray") {
        app_.require_subcommand(1);
        app_.set_version_flag("--version", fmt::format("morphray {}", kVersionDetail));
        app_.footer(
            "SCENE is builtin:NAME[:TRIANGLES], an .obj file, a folder of .obj files, or a pattern "
            "such as frame_%04d.obj.\n`morphray help COMMAND` or `morphray COMMAND --help` lists "
            "the options "
            "of a command; `morphray info` the built-in scenes.\nExit codes: 0 ok, 1 a check "
            "failed, 2 usage, 3 "
            "bad input, 4 backend or device unavailable, 5 output cannot be written, 6 out of "
            "memory or over a limit, 7 device lost, 8 partial result kept, 70 internal error, 130 "
            "and 143 interrupted.");
        define_render();
        define_crosscheck();
        define_probe();
        define_profile();
        define_trace();
        define_chart();
        define_info();
        define_devices();
    }

    ParsedCommandLine parse(std::span<const std::string> arguments);

private:
    void define_render();
    void define_crosscheck();
    void define_probe();
    void define_profile();
    void define_trace();
    void define_chart();
    void define_info();
    void define_devices();

    CLI::App& add_command(const char* name, const char* help, Command command) {
        CLI::App& sub = *app_.add_subcommand(name, help);
        sub.callback([this, command] { options_.command = command; });
        return sub;
    }

    CLI::Option* add(CLI::App& command, const char* name, const char* type, const std::string& help,
                     Setter set) {
        const std::string option = name;
        return command
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

    CLI::Option* add_text(CLI::App& command, const char* name, const char* type,
                          const std::string& help, std::string& target) {
        return add(command, name, type, help,
                   [&target](const std::string&, const std::string& value) { target = value; });
    }

    template <class T>
    void add_choice(CLI::App& command, const char* name, const std::string& help,
                    std::type_identity_t<std::span<const Choice<T>>> choices, T& target) {
        add(command, name, "", help,
            [choices, &target](const std::string& option, const std::string& value) {
                target = parse_choice<T>(option, value, choices);
            })
            ->type_name(names_of<T>(choices));
    }

    void add_flag(CLI::App& command, const char* name, const char* help, bool& target) {
        command.add_flag(name, target, help)->multi_option_policy(CLI::MultiOptionPolicy::Throw);
    }

    // As above for what decides which image is seen: also kept to be repeated.
    void add_view(CLI::App& command, const char* name, const char* type, const char* help,
                  Setter set) {
        add(command, name, type, help,
            [this, set = std::move(set)](const std::string& option, const std::string& value) {
                options_.view_arguments.insert(options_.view_arguments.end(), {option, value});
                set(option, value);
            });
    }

    void add_scene(CLI::App& command, bool required);
    void add_frames(CLI::App& command, const char* otherwise);
    void add_view_options(CLI::App& command, const char* default_size, const char* default_rays);
    void add_backend_options(CLI::App& command, std::span<const Choice<BackendChoice>> choices,
                             const char* otherwise);
    /// `update` is what --update is without being given; null: there is none.
    void add_tree_options(CLI::App& command, const char* update);
    void add_update_limits(CLI::App& command);
    void add_report_options(CLI::App& command, bool with_quiet);

    std::string help(std::span<const std::string> topics) const;
    FailedParse describe(const CLI::ParseError& error,
                         std::span<const std::string> arguments) const;

    Options options_;
    CLI::App app_;
};

void CommandLine::add_scene(CLI::App& command, bool required) {
    CLI::Option* scene = add_text(command, "scene", "SCENE", "what to trace", options_.scene);
    if (required) scene->required();
    add_view(command, "--missing", "fail|hold|skip",
             "what to do about missing frames of a sequence",
             [this](const std::string& option, const std::string& value) {
                 options_.missing = parse_choice<MissingFrames>(option, value, kMissing);
             });
    add_flag(command, "--allow-empty", "accept a scene without triangles", options_.allow_empty);
    add_flag(command, "--lenient", "accept vertices that are not finite and faces that are none",
             options_.lenient);
}

void CommandLine::add_frames(CLI::App& command, const char* otherwise) {
    add_text(command, "--frames", "A..B[:STEP]",
             fmt::format("frames; fractions lie between whole frames ({})", otherwise),
             options_.frames);
}

void CommandLine::add_view_options(CLI::App& command, const char* default_size,
                                   const char* default_rays) {
    ViewSpec& view = options_.view;
    add(command, "--size", "WxH", fmt::format("size of the image in pixels ({})", default_size),
        [this](const std::string& option, const std::string& value) {
            const Size size = parse_size(option, value);
            options_.view.width = size.width;
            options_.view.height = size.height;
            options_.size_given = true;
        });
    add_view(command, "--eye", "X,Y,Z", "where the camera is",
             [&view](const std::string& option, const std::string& value) {
                 view.eye = parse_point(option, value);
             });
    add_view(command, "--target", "X,Y,Z", "what it looks at",
             [&view](const std::string& option, const std::string& value) {
                 view.target = parse_point(option, value);
             });
    add_view(command, "--up", "X,Y,Z", "upwards in the image (0,1,0)",
             [&view](const std::string& option, const std::string& value) {
                 view.up = parse_point(option, value);
             });
    add_view(command, "--fov", "DEGREES", "vertical field of view (45)",
             [&view](const std::string& option, const std::string& value) {
                 view.fov = parse_number(option, value);
             });
    add_view(command, "--light", "X,Y,Z", "point light",
             [&view](const std::string& option, const std::string& value) {
                 view.light = parse_point(option, value);
             });
    add(command, "--rays", "primary|shadow|ao",
        fmt::format("what each pixel traces ({})", default_rays),
        [this](const std::string& option, const std::string& value) {
            options_.view.rays = parse_choice<std::uint32_t>(option, value, kRays);
            options_.rays_given = true;
        });
    add_view(command, "--ao-samples", "N", "ambient-occlusion rays a pixel, 1 to 256 (16)",
             [&view](const std::string& option, const std::string& value) {
                 view.ao_count = static_cast<std::uint32_t>(parse_count(option, value, 1, 256));
             });
    add_view(command, "--ao-distance", "LENGTH", "their length; 0: a quarter of the diagonal",
             [&view](const std::string& option, const std::string& value) {
                 view.ao_distance = parse_finite(option, value, 0);
             });
}

void CommandLine::add_backend_options(CLI::App& command,
                                      std::span<const Choice<BackendChoice>> choices,
                                      const char* otherwise) {
    BackendOptions& backend = options_.backend;
    add(command, "--backend", "", fmt::format("what traces ({})", otherwise),
        [&backend, choices](const std::string& option, const std::string& value) {
            backend.choice = parse_choice<BackendChoice>(option, value, choices);
            backend.choice_given = true;
        })
        ->type_name(names_of<BackendChoice>(choices));
    add_text(command, "--device", "DEVICE",
             "Vulkan device: its index, a part of its name, or its UUID (see `devices`)",
             backend.device);
    add(command, "--threads", "N", "CPU threads, 1 to 1024 (all there are)",
        [&backend](const std::string& option, const std::string& value) {
            backend.threads = static_cast<int>(parse_count(option, value, 1, 1024));
        });
    add(command, "--simd", "NAME",
        "CPU instruction set (the best one; see `info`), or off: the plain reference",
        [&backend](const std::string& option, const std::string& value) {
            try {
                cpu::check_simd(value);
            } catch (const Error& error) {
                throw Error(error.kind(), option + ": " + error.what());
            }
            backend.simd = value;
        });
    add_flag(command, "--validate", "run under the Vulkan validation layer", backend.validate);
}

void CommandLine::add_tree_options(CLI::App& command, const char* update) {
    TreeOptions& tree = options_.tree;
    if (update != nullptr) {
        command.preparse_callback([&tree, update](std::size_t) { tree.update = update; });
        add(command, "--update", "", fmt::format("how the tree follows the vertices ({})", update),
            [&tree](const std::string& option, const std::string& value) {
                tree.update = parse_update(option, value);
            })
            ->type_name(update_forms());
        add_update_limits(command);
        add_choice(command, "--refit-on", "which backend refits (the one that traces)", kRefitOn,
                   tree.refit_on);
    }
    add_view(command, "--build", "binned|sweep", "how the tree is built (binned)",
             [&tree](const std::string& option, const std::string& value) {
                 tree.split = parse_choice<SplitMethod>(option, value, kSplits);
             });
    add(command, "--build-at", "FRAME",
        "the frame that the tree is built at (the first one asked for)",
        [&tree](const std::string& option, const std::string& value) {
            tree.build_at = parse_finite(option, value, -1e9);
        });
}

void CommandLine::add_update_limits(CLI::App& command) {
    UpdateConfig& config = options_.tree.update_config;
    add(command, "--update-budget", "N%|Nms",
        "what an update may add to a frame; a build that takes longer runs in the background (75%)",
        [&config](const std::string& option, const std::string& value) {
            parse_update_budget(option, value, config);
        });
    add_flag(command, "--deterministic-updates",
             "decide from counts of triangles and rays instead of times", config.deterministic);
}

void CommandLine::add_report_options(CLI::App& command, bool with_quiet) {
    add_text(command, "--json", "FILE|-", "a report for programs; - is stdout", options_.json);
    if (!with_quiet) return;
    add_flag(command, "-q,--quiet", "neither table nor progress", options_.quiet);
    add_flag(command, "-v,--verbose", "say what is used and decided", options_.verbose);
}

void CommandLine::define_render() {
    CLI::App& command =
        add_command("render", "One image per frame, and a contact sheet", Command::kRender);
    add_scene(command, true);
    add_frames(command, "all whole ones");
    add_view_options(command, kWholeImage, "primary");
    add_backend_options(command, kBackends, kVulkanOrCpu);
    add_tree_options(command, "auto");
    add_text(command, "--out", "DIR", "folder of the images (out)", options_.out);
    add_text(command, "--hits", "FILE", "the raw hits of all frames", options_.hits);
    add_report_options(command, true);
}

void CommandLine::define_crosscheck() {
    CLI::App& command =
        add_command("crosscheck", "Every backend and tree against a reference, bit by bit",
                    Command::kCrosscheck);
    add_scene(command, true);
    add_frames(command, kFewFrames);
    add_view_options(command, "256x256", "all three, one after the other");
    add_backend_options(command, kCheckedBackends, "all");
    add_tree_options(command, nullptr);
    add_choice(command, "--reference", "what the variants are held against (auto)", kReferences,
               options_.reference);
    add_text(command, "--out", "DIR", "folder of difference images (out/crosscheck)", options_.out);
    add_text(command, "--junit", "FILE|-", "a JUnit report; - is stdout", options_.junit);
    add_report_options(command, true);
}

void CommandLine::define_probe() {
    CLI::App& command =
        add_command("probe", "One pixel with everything that decides it", Command::kProbe);
    add_scene(command, true);
    add(command, "--frame", "F", "the frame",
        [this](const std::string& option, const std::string& value) {
            options_.frame = parse_finite(option, value, -1e9);
        })
        ->required();
    add(command, "--pixel", "X,Y", "the pixel, from the upper left corner",
        [this](const std::string& option, const std::string& value) {
            options_.pixel = parse_pixel(option, value);
        })
        ->required();
    add_view_options(command, kWholeImage, "primary");
    add_backend_options(command, kBackends, kVulkanOrCpu);
    add_tree_options(command, "refit");
    add_report_options(command, false);
}

void CommandLine::define_profile() {
    CLI::App& command = add_command("profile", "Times of deforming, refitting, building, tracing",
                                    Command::kProfile);
    add_scene(command, true);
    add_frames(command, kFewFrames);
    add_view_options(command, kWholeImage, "primary");
    add_backend_options(command, kBackends, "auto: the CPU, and Vulkan where there is a device");
    add_tree_options(command, nullptr);
    add(command, "--repeat", "N", "runs of which the median counts (5)",
        [this](const std::string& option, const std::string& value) {
            options_.repeat = static_cast<int>(parse_count(option, value, 1, 10000));
        });
    add(command, "--policies", "A,B,...",
        fmt::format("compare update policies over all whole frames: {}", update_forms()),
        [this](const std::string& option, const std::string& value) {
            options_.policies = parse_updates(option, value);
        });
    add(command, "--update", "", "the same for a single one",
        [this](const std::string& option, const std::string& value) {
            options_.tree.update = parse_update(option, value);
        })
        ->type_name(update_forms());
    add_update_limits(command);
    add_text(command, "--trace-events", "FILE|-",
             "of --policies, the stages in Chrome's trace format", options_.trace_events);
    add_text(command, "--plot", "FILE.svg|.png", "of --policies, charts (needs gnuplot)",
             options_.plot);
    add_text(command, "--csv", "FILE|-", "the table as comma-separated values; - is stdout",
             options_.csv);
    add_report_options(command, true);
}

void CommandLine::define_trace() {
    CLI::App& command = add_command("trace", "Rays from a file to hits in a file", Command::kTrace);
    add_scene(command, true);
    add_frames(command, kFirstFrame);
    add_text(command, "--rays", "FILE|-", "a line `ox oy oz dx dy dz [tnear tfar]` for each ray",
             options_.ray_file)
        ->required();
    add_text(command, "--out", "FILE|-", "a line `H t prim u v` or `M` for each ray", options_.out)
        ->required();
    add_flag(command, "--binary", "rays are 8 little-endian floats each", options_.binary_rays);
    add_backend_options(command, kBackends, "cpu; with --device or --validate vulkan");
    add_flag(command, "-q,--quiet", "no progress", options_.quiet);
}

void CommandLine::define_chart() {
    CLI::App& command =
        add_command("chart", "Speed against accuracy, as images and data", Command::kChart);
    command.add_option("scenes", options_.scenes, "what to trace, at the middle frame")
        ->type_name("SCENE")
        ->required();
    add_text(command, "--out", "DIR", "a folder that is not there yet, or empty", options_.out)
        ->required();
    add_flag(command, "--quick", "fewer rays and runs: a minute instead of ten", options_.quick);
    add_flag(command, "--lenient", "accept vertices that are not finite and faces that are none",
             options_.lenient);
    add_flag(command, "-q,--quiet", "neither result nor progress", options_.quiet);
}

void CommandLine::define_info() {
    CLI::App& command =
        add_command("info", "What a scene is made of; without one, this program", Command::kInfo);
    add_scene(command, false);
    add_frames(command, kFirstFrame);
    add_flag(command, "--bvh", "build the tree both ways and describe it", options_.tree_facts);
    add(command, "--threads", "N", "CPU threads, 1 to 1024 (all there are)",
        [this](const std::string& option, const std::string& value) {
            options_.backend.threads = static_cast<int>(parse_count(option, value, 1, 1024));
        });
    add_report_options(command, false);
}

void CommandLine::define_devices() {
    add_report_options(add_command("devices", "The Vulkan devices", Command::kDevices), false);
}

std::vector<std::string> command_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* sub : app.get_subcommands({})) names.push_back(sub->get_name());
    return names;
}

std::vector<std::string> option_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options()) {
        names.insert(names.end(), option->get_lnames().begin(), option->get_lnames().end());
    }
    return names;
}

// Of the program, or of the command that is named after `help`.
std::string CommandLine::help(std::span<const std::string> topics) const {
    if (topics.size() > 1) {
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("unexpected argument '{}'; see `morphray help`", topics[1]));
    }
    if (topics.empty() || topics[0] == "help" || topics[0] == "--help" || topics[0] == "-h") {
        return app_.help();
    }
    for (const CLI::App* sub : app_.get_subcommands({})) {
        if (sub->get_name() == topics[0]) return sub->help(app_.get_name());
    }
    reject_command(topics[0], command_names(app_));
}

FailedParse CommandLine::describe(const CLI::ParseError& error,
                                  std::span<const std::string> arguments) const {
    const std::vector<const CLI::App*> chosen =
        app_.get_subcommands([](const CLI::App* sub) { return sub->parsed(); });
    const CLI::App& command = chosen.empty() ? app_ : *chosen.front();
    FailedParse parse;
    parse.arguments = arguments;
    parse.commands = command_names(app_);
    if (!chosen.empty()) parse.command = command.get_name();
    parse.program_options = option_names(app_);
    parse.options = option_names(command);
    for (const CLI::Option* option : command.get_options()) {
        if (option->count() <= parse.times) continue;
        parse.repeated = option->get_name();
        parse.times = option->count();
    }
    parse.extras = app_.remaining(true);
    parse.message = error.what();
    return parse;
}

ParsedCommandLine CommandLine::parse(std::span<const std::string> arguments) {
    if (!arguments.empty() && arguments.front() == "help") {
        return {std::nullopt, help(arguments.subspan(1))};
    }
    try {
        app_.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    } catch (const CLI::Success& success) {
        std::ostringstream out;
        app_.exit(success, out, out);
        return {std::nullopt, out.str()};
    } catch (const CLI::ParseError& error) {
        explain(describe(error, arguments));
    }
    check_conflicts(options_);
    return {options_, {}};
}

}  // namespace

ParsedCommandLine parse_command_line(std::span<const std::string> arguments) {
    return CommandLine().parse(arguments);
}

}  // namespace morphray::app
