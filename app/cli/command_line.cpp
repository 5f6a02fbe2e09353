#include "app/cli/command_line.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

#include "app/cli/option_groups.h"
#include "common/base/errors.h"
#include "common/text/text.h"
#include "common/version.h"

namespace mray::app {
namespace {

constexpr std::size_t kTextColumn = 30;
/// The heading of the options that --help has.
constexpr const char* kEveryday = "Options";

constexpr const char* kFooter =
    "`morphray help COMMAND` lists the everyday options of a command, `morphray COMMAND "
    "--help-all` all of them; `morphray info` lists the built-in scenes.\n\n"
    "Exit codes: 0 ok, 1 a check failed, 2 usage, 3 bad input, 4 backend or device unavailable, "
    "5 output cannot be written, 6 out of memory or over a limit, 7 device lost, 8 partial result "
    "kept, 70 internal error, 129 ended by SIGHUP, 130 ended by SIGINT (Ctrl-C), 143 ended by "
    "SIGTERM.";

/// CLI11's help in 80 columns.
class HelpFormatter : public CLI::Formatter {
public:
    HelpFormatter() {
        column_width(kTextColumn);
        label("Positionals", "Arguments");
        label("SUBCOMMAND", "COMMAND");
    }

    /// --help has the everyday options alone.
    std::string make_help(const CLI::App* app, std::string name,
                          CLI::AppFormatMode mode) const override {
        std::string groups;
        for (const std::string& group : app->get_groups()) {
            if (mode == CLI::AppFormatMode::Normal && group != kEveryday) continue;
            groups += make_group(group, false, app->get_options([&](const CLI::Option* option) {
                return option->nonpositional() && option->get_group() == group;
            }));
        }
        return make_description(app) + make_usage(app, name) + make_positionals(app) + groups +
               make_subcommands(app, mode) + '\n' + make_footer(app);
    }
    std::string make_option_opts(const CLI::Option* option) const override {
        const std::string text = option->get_option_text();
        return (text.empty() ? "" : ' ' + text) + (option->get_required() ? " REQUIRED" : "");
    }
    std::string make_option_desc(const CLI::Option* option) const override {
        return wrapped(option->get_description(), 0, kColumns - kTextColumn);
    }
    std::string make_subcommand(const CLI::App* sub) const override {
        std::ostringstream out;
        CLI::detail::format_help(out, sub->get_name(),
                                 wrapped(sub->get_description(), 0, kColumns - kTextColumn),
                                 kTextColumn);
        return out.str();
    }
};

class CommandAdder {
public:
    CommandAdder(CLI::App& app, ParsedCommandLine& parsed) : app_(app), parsed_(parsed) {}

    /// Adds a command by `define(command, options)`, which returns what completes the options after
    /// the parse. `everyday` names the options of --help; without any, --help has all.
    template <class Options, class Define>
    void add(const char* name, const char* help, std::string_view everyday, const char* examples,
             Define define) {
        CLI::App& command = *app_.add_subcommand(name, help)->group("Commands");
        command.footer(std::string("Examples:\n") + examples);
        if (!everyday.empty()) command.set_help_all_flag("--help-all", "print all options");
        const auto options = std::make_shared<Options>();
        const auto complete = define(command, *options);
        if (everyday.empty())
            for (CLI::Option* const option : command.get_options()) option->group(kEveryday);
        else
            for (const std::string_view one : split(everyday, ' '))
                command.get_option(std::string(one))->group(kEveryday);
        command.callback([&parsed = parsed_, options, complete] {
            complete();
            parsed.options = *options;
        });
    }

    void add_quiet(CLI::App& command) const {
        command.add_flag("-q,--quiet", parsed_.quiet, "neither table nor progress");
    }
    void add_verbose(CLI::App& command) const {
        command.add_flag("-v,--verbose", parsed_.verbose, "say what is used and decided");
    }

private:
    CLI::App& app_;
    ParsedCommandLine& parsed_;
};

/// Completes the options of a command that has nothing to complete.
constexpr auto kNothing = [] {};

constexpr const char* kFewFrames = "the first, those at a quarter and a half, the last";
constexpr const char* kVulkanOrCpu = "auto: Vulkan where there is a GPU, else the CPU";

/// "refit|rebuild|...": the forms of all policies.
std::string update_forms() { return fmt::format("{}", fmt::join(policy_forms(), "|")); }

/// Adds the options that render and view share. Returns a function that fills in defaults.
auto add_image_options(CLI::App& command, ImageOptions& image, const char* size,
                       const char* samples_help) {
    add_scene(command, image.source)->required();
    add_view_options(command, image.view, size, 0, "8 with lit, else 16");
    CLI::Option* const rays = add_rays(command, image.view, "those of --shading lit");
    add_choice<morphray::Shading>(command, "--shading",
                                  "what colours show (lit): light and sky, one colour, normals, "
                                  "depths, triangles (prim), nodes and leaves that a ray enters "
                                  "(steps), cost of the tree's leaves (sah)",
                                  kShadings, image.view.shading)
        ->excludes(rays);
    CLI::Option* const samples = add_choice<std::uint32_t>(command, "--samples", samples_help,
                                                           kSampleCounts, image.view.samples);
    command.add_flag("--flat", image.view.flat, "without smooth normals");
    add_choice<bool>(command, "--ground",
                     "a plane below the scene that shows shadows (on with lit for files, without "
                     "--hits and --exr)",
                     kOnOff, image.ground);
    add_backend_options(command, image.backend, kBackends, kVulkanOrCpu);
    add_build_at(command, image.tree.build_at);
    add_parsed(
        command, "--update", update_forms(),
        "how the tree follows the vertices (auto): boxes computed again, a new tree for each "
        "frame or every K, or what pays",
        image.tree.update, parse_policy);
    heading(command, "Output");
    const CLI::Option* const ao_samples = command.get_option("--ao-samples");
    return [=, &image](std::uint32_t lit_samples) {
        using morphray::Shading;
        if (rays->count() > 0) image.view.shading = Shading::plain;
        const bool is_lit = image.view.shading == Shading::lit;
        constexpr std::uint32_t kLitAoCount = 8;
        if (is_lit && ao_samples->count() == 0) image.view.ao_count = kLitAoCount;
        if (!is_lit && image.view.ao_count == 0)
            refuse("--ao-samples 0: only --shading lit goes without ambient occlusion");
        if (samples->count() == 0) image.view.samples = is_lit ? lit_samples : 1;
    };
}

void add_render(CommandAdder& adder) {
    adder.add<RenderOptions>(
        "render", "Writes an image of each frame",
        "--frames --out --size --eye --target --light --shading --samples --ground --backend",
        "  morphray render builtin:cloth --frames 0..24:8 --out cloth\n"
        "  morphray render builtin:twist --frame 12 --samples 1 --out twist.png",
        [&adder](CLI::App& command, RenderOptions& options) {
            const auto complete =
                add_image_options(command, options.image, "1024x1024",
                                  "camera rays a pixel (4 with lit and without --hits, else 1)");
            add_frames(command, options.frames, "all whole frames");
            add_choice<const char*>(command, "--exr",
                                    "also OpenEXR files, with linear colours and layers",
                                    kExrColours, options.image.exr);
            add_text(command, "-o,--out", "DIR|FILE.png",
                     "folder of the images, or one image (out)", options.out);
            add_text(command, "--hits", "FILE", "file of the raw hits of all frames", options.hits);
            add_json(command, options.json);
            adder.add_quiet(command);
            adder.add_verbose(command);
            return [complete, &options] {
                complete(options.hits.empty() ? 4 : 1);
                ImageOptions& image = options.image;
                const bool has_data = !options.hits.empty() || !image.exr.empty();
                if (!image.ground && has_data) image.ground = false;
                if (!options.hits.empty() && (*image.ground || image.view.samples != 1))
                    refuse(
                        "--hits: a file of hits has one camera ray a pixel and one mesh; leave "
                        "--samples and --ground out");
                if (!image.exr.empty() && image.view.shading != morphray::Shading::lit)
                    refuse("--exr: only --shading lit has linear colours");
                if (!lower_case(options.out).ends_with(".png"))
                    refuse_file_name(options.out,
                                     "give a .png file, or a folder, of which ffmpeg makes a video "
                                     "as docs/guide/start.md shows");
            };
        });
}

void add_view(CommandAdder& adder) {
    adder.add<ViewOptions>(
        "view", "A window that shows the scene move, and how it is traced",
        "--frame --play --size --eye --target --light --shading --ground --backend --screenshot",
        "  morphray view builtin:cloth --play\n"
        "  morphray view builtin:cloth --frame 8 --screenshot cloth.png",
        [&adder](CLI::App& command, ViewOptions& options) {
            const auto complete = add_image_options(
                command, options.image, "1280x720",
                "camera rays a pixel of a still image (16; 4 with lit and --screenshot)");
            add_frame(command, options.frame);
            command.add_flag("--play", options.plays, "begin to play at once");
            add_text(command, "--screenshot", "FILE.png",
                     "write the first image that is complete, and end", options.screenshot);
            adder.add_quiet(command);
            adder.add_verbose(command);
            const CLI::Option* const samples = command.get_option("--samples");
            return [=, &options] {
                // A still image goes on to be refined; a screenshot is what render writes.
                complete(4);
                if (options.screenshot.empty() && samples->count() == 0)
                    options.image.view.samples = 16;
                if (options.screenshot.empty()) return;
                options.plays = false;
                if (!lower_case(options.screenshot).ends_with(".png"))
                    refuse("--screenshot: give a .png file");
            };
        });
}

void add_crosscheck(CommandAdder& adder, std::span<const std::string> arguments) {
    adder.add<CrosscheckOptions>(
        "crosscheck", "Compares every backend and tree with a reference, bit by bit",
        "--frames --size --eye --target --rays --backend --queries --html --junit --json",
        "  morphray crosscheck builtin:cloth:500 --html crosscheck.html\n"
        "  morphray crosscheck builtin:spikes --backend cpu --queries 100",
        [&](CLI::App& command, CrosscheckOptions& options) {
            options.arguments.assign(arguments.begin(), arguments.end());
            command.add_option("SCENES", options.scenes, "what to trace, one after the other")
                ->required();
            add_source_options(command, options.source);
            add_frames(command, options.frames, kFewFrames);
            add_view_options(command, options.view, "256x256", 1, "16");
            add_choice<morphray::Rays>(command, "--rays", "what each pixel traces (all three)",
                                       kRays, options.rays);
            add_backend_options(command, options.backend, kCheckedBackends, "all");
            heading(command, "Output");
            add_choice<Reference>(command, "--reference",
                                  "what the others are compared with (auto: brute force where that "
                                  "takes seconds, else the CPU)",
                                  kReferences, options.reference);
            add_count(command, "--queries",
                      "also compare hits, windings and closest triangles of N rays and points",
                      options.query_count, 1, 1'000'000);
            add_text(command, "--junit", "FILE|-", "a JUnit report; - is stdout", options.junit);
            add_text(command, "--html", "FILE|-", "a page that needs no network; - is stdout",
                     options.html);
            add_json(command, options.json);
            adder.add_quiet(command);
            return kNothing;
        });
}

void add_probe(CommandAdder& adder) {
    adder.add<ProbeOptions>(
        "probe", "Describes one pixel: its ray, its hit, the triangles that it could hit",
        "--frame --pixel --size --eye --target --rays --backend --update --build-at",
        "  morphray probe builtin:cloth --frame 8 --pixel 512,600",
        [&adder](CLI::App& command, ProbeOptions& options) {
            add_scene(command, options.source)->required();
            add_parsed(command, "--frame,--frames", "F", "the frame", options.frame, parse_frame)
                ->required();
            add_pair(command, "--pixel", "X,Y", "the pixel, from the upper left corner", ',', 0,
                     options.pixel.x, options.pixel.y)
                ->required();
            add_view_options(command, options.view, "1024x1024", 1, "16");
            add_rays(command, options.view, "primary");
            add_backend_options(command, options.backend, kBackends, kVulkanOrCpu);
            add_build_at(command, options.tree.build_at);
            add_parsed(command, "--update", "refit|rebuild",
                       "how the tree follows the vertices (refit)", options.tree.update,
                       parse_policy);
            heading(command, "Output");
            adder.add_verbose(command);
            return kNothing;
        });
}

void add_profile(CommandAdder& adder) {
    adder.add<ProfileOptions>(
        "profile", "Measures deforming, refitting, building and tracing",
        "--frames --size --rays --backend --repeat --policies --plot --csv --json",
        "  morphray profile builtin:cloth --backend cpu --frames 0..24:12\n"
        "  morphray profile builtin:twist --policies refit,auto --csv policies.csv",
        [&adder](CLI::App& command, ProfileOptions& options) {
            add_scene(command, options.source)->required();
            add_frames(command, options.frames, kFewFrames);
            add_view_options(command, options.view, "1024x1024", 1, "16");
            add_rays(command, options.view, "primary");
            add_backend_options(command, options.backend, kBackends,
                                "auto: the CPU, and Vulkan where there is a device");
            add_build_at(command, options.tree.build_at);
            heading(command, "Output");
            add_count(command, "--repeat", "runs whose median is reported (10; of policies 5)",
                      options.repeat, 1, 10000);
            CLI::Option* const policies =
                add_parsed(command, "--policies", update_forms() + ",...",
                           "update policies to compare, over all whole frames", options.policies,
                           [](const std::string& text) {
                               std::vector<PolicySpec> parsed;
                               for (const std::string_view part : split(text, ','))
                                   parsed.push_back(parse_policy(std::string(part)));
                               return parsed;
                           });
            add_text(command, "--plot", "FILE.svg|.png", "charts of policies (needs gnuplot)",
                     options.plot)
                ->needs(policies);
            add_text(command, "--csv", "FILE|-", "the table as comma-separated values; - is stdout",
                     options.csv);
            add_json(command, options.json);
            adder.add_quiet(command);
            return kNothing;
        });
}

void add_diff(CommandAdder& adder) {
    adder.add<DiffOptions>(
        "diff", "Compares two files of hits bit by bit", "",
        "  morphray render builtin:cloth --frame 8 --hits a.hits\n"
        "  morphray render builtin:cloth --frame 8 --backend cpu --simd off --hits b.hits\n"
        "  morphray diff a.hits b.hits",
        [&adder](CLI::App& command, DiffOptions& options) {
            command.add_option("FILES", options.files, "the expected hits, and the other")
                ->required()
                ->expected(2);
            adder.add_quiet(command);
            return kNothing;
        });
}

template <class Options>
void add_answers(const CommandAdder& adder, CLI::App& command, Options& options) {
    add_scene(command, options.source)->required();
    add_frame(command, options.frame);
    add_backend_options(command, options.backend, kBackends, "cpu");
    heading(command, "Output");
    adder.add_quiet(command);
}

void refuse_idle_device(const BackendOptions& backend) {
    const bool has_vulkan =
        backend.choice == BackendChoice::kVulkan || backend.choice == BackendChoice::kAuto;
    if (!has_vulkan && (!backend.device.empty() || backend.validate))
        refuse("--device, --validate: nothing runs on a device; choose --backend vulkan");
}

void add_trace(CommandAdder& adder) {
    adder.add<TraceOptions>(
        "trace", "Traces the rays of a file, and writes their hits to a file",
        "--frame --backend --rays --out --binary --all --max-hits --crossing",
        "  echo 0 9 0 0 -1 0 | morphray trace builtin:cloth --rays - --out -\n"
        "  echo 0 9 0 0 -1 0 | morphray trace builtin:cloth --rays - --out - --all",
        [&adder](CLI::App& command, TraceOptions& options) {
            add_answers(adder, command, options);
            add_text(command, "--rays", "FILE|-",
                     "a line `ox oy oz dx dy dz [tnear tfar [prim_id]]` for each ray, or an array "
                     "(.npy)",
                     options.ray_file)
                ->required();
            add_text(
                command, "-o,--out", "FILE|-",
                "a line for each ray: `H t prim u v` (prim: the triangle's number) or `M`, a miss",
                options.out)
                ->required();
            command.add_flag("--binary", options.binary_rays,
                             "rays are 8 little-endian floats each: org, tnear, dir, tfar");
            CLI::Option* const all = command.add_flag(
                "--all", options.all_hits,
                "all hits of each ray, nearest first: a line `R hits left-out`, then those");
            add_count(command, "--max-hits", "the most hits of a ray that are written (all)",
                      options.hit_lists.max_hits, 1, std::numeric_limits<std::uint32_t>::max())
                ->needs(all);
            add_choice<morphray::Crossing>(
                command, "--crossing",
                "which triangles a ray hits that goes through an edge or a vertex: the first of a "
                "mesh (once), each, or one of those that it passes through (owner)",
                kCrossings, options.hit_lists.crossing)
                ->needs(all);
            return [&options] { refuse_idle_device(options.backend); };
        });
}

std::vector<PointQuery> parse_point_queries(const std::string& text) {
    std::vector<PointQuery> queries;
    for (const std::string_view part : split(text, ',')) {
        queries.push_back(value_in<PointQuery>(kPointQueries, part));
        if (std::ranges::count(queries, queries.back()) > 1)
            refuse(std::string(part) + " is given twice");
    }
    return queries;
}

void add_query(CommandAdder& adder) {
    adder.add<QueryOptions>(
        "query", "Says where the points of a file are: inside, how far, closest to",
        "--frame --backend --points --ask --rule --max-distance --out",
        "  echo 0 1 0 | morphray query builtin:spikes --points - --ask inside,distance\n"
        "  echo 0 1 0 | morphray query builtin:cloth --frame 8 --points - --ask closest",
        [&adder](CLI::App& command, QueryOptions& options) {
            add_answers(adder, command, options);
            add_text(command, "--points", "FILE|-", "a line `x y z` for each point",
                     options.point_file)
                ->required();
            add_parsed(command, "--ask", names_of<PointQuery>(kPointQueries) + ",...",
                       "what is answered, in this order: inside: 0 or 1; winding: how often meshes "
                       "wind around the point; distance: to the surface, negative inside; closest: "
                       "`x y z distance prim u v feature` (prim: the triangle's number)",
                       options.queries, parse_point_queries)
                ->required();
            add_choice<morphray::FillRule>(
                command, "--rule",
                "which points are inside: those that meshes wind around, or those with an odd "
                "number of crossings (nonzero)",
                kFillRules, options.rule);
            add_parsed(command, "--max-distance", "LENGTH",
                       "how far the surface may be (any distance)", options.max_distance,
                       [](const std::string& text) {
                           constexpr double kMost = std::numeric_limits<float>::max();
                           return static_cast<float>(std::min(parse_finite(text, 0), kMost));
                       });
            add_text(command, "-o,--out", "FILE|-", "a line of answers for each point (stdout)",
                     options.out);
            return [&options] { refuse_idle_device(options.backend); };
        });
}

void add_chart(CommandAdder& adder) {
    adder.add<ChartOptions>(
        "chart", "Draws charts of speed against accuracy, as images and data", "",
        "  morphray chart builtin:cloth --out charts --quick",
        [&](CLI::App& command, ChartOptions& options) {
            command.add_option("SCENES", options.scenes, "what to trace, at the middle frame")
                ->required();
            add_text(command, "-o,--out", "DIR", "a folder that does not exist yet or is empty",
                     options.out)
                ->required();
            command.add_flag("--quick", options.quick, "fewer rays and runs");
            add_lenient(command, options.lenient);
            adder.add_quiet(command);
            return [&options] { refuse_file_name(options.out, "give a folder"); };
        });
}

void add_info(CommandAdder& adder) {
    adder.add<InfoOptions>(
        "info", "Describes a scene; without a scene, this program", "",
        "  morphray info builtin:cloth --bvh", [](CLI::App& command, InfoOptions& options) {
            CLI::Option* const scene = add_scene(command, options.source);
            add_frame(command, options.frame)->needs(scene);
            command.add_flag("--bvh", options.tree_facts, "build the tree and describe it")
                ->needs(scene);
            add_json(command, options.json)->needs(scene);
            return kNothing;
        });
}

void add_devices(CommandAdder& adder) {
    adder.add<DevicesOptions>(
        "devices", "Lists the Vulkan devices, and tests them", "", "  morphray devices --check",
        [](CLI::App& command, DevicesOptions& options) {
            command.add_flag("--check", options.checks,
                             "compare rays, shading and refit of each device with the CPU's");
            add_json(command, options.json);
            return kNothing;
        });
}

void add_commands(CLI::App& app, ParsedCommandLine& parsed,
                  std::span<const std::string> arguments) {
    CommandAdder adder(app, parsed);
    add_render(adder);
    add_view(adder);
    add_crosscheck(adder, arguments);
    add_diff(adder);
    add_probe(adder);
    add_profile(adder);
    add_trace(adder);
    add_query(adder);
    add_chart(adder);
    add_info(adder);
    add_devices(adder);
}

}  // namespace

ParsedCommandLine parse_command_line(std::span<const std::string> arguments) {
    std::vector<std::string> line(arguments.begin(), arguments.end());
    // `help COMMAND` is `COMMAND --help`.
    if (!line.empty() && line.front() == "help") {
        line.erase(line.begin());
        line.emplace_back("--help");
    }
    ParsedCommandLine parsed;
    CLI::App app("Ray tracer for triangle scenes that deform.", "morphray");
    app.require_subcommand(1);
    app.formatter(std::make_shared<HelpFormatter>());
    app.set_help_flag("-h,--help", "print this help");
    app.footer(wrapped(kFooter));
    app.set_version_flag("-v,--version", fmt::format("morphray {}", kVersionDetail),
                         "print the version");
    add_commands(app, parsed, arguments);
    std::reverse(line.begin(), line.end());
    try {
        app.parse(line);
    } catch (const CLI::Success& success) {
        std::ostringstream out;
        app.exit(success, out, out);
        return {std::nullopt, out.str()};
    } catch (const CLI::ParseError& error) {
        const std::vector<CLI::App*> chosen = app.get_subcommands();
        // CLI11 misses a command before it says which word is none.
        const std::vector<std::string> extras = app.remaining(true);
        const std::string command = chosen.empty() ? "" : chosen.front()->get_name() + ' ';
        if (!extras.empty() && !extras[0].starts_with('-') && !chosen.empty() &&
            chosen.front()->get_option_no_throw("SCENE") != nullptr)
            refuse(
                fmt::format("{} is one argument too many: {}takes one SCENE; put a pattern of "
                            "files in quotes, which keep it from the shell",
                            quote(extras[0]), command));
        refuse(fmt::format("{}; see `morphray {}--help`",
                           extras.empty() ? error.what() : "unknown argument " + quote(extras[0]),
                           command));
    }
    return parsed;
}

}  // namespace mray::app
