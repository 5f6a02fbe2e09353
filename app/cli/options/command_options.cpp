#include "app/cli/options/command_options.h"

#include <fmt/format.h>

#include "app/cli/numbers.h"
#include "app/cli/options/option_groups.h"
#include "app/cli/update_options.h"

namespace mray::app {
namespace {

// Defaults that several commands have in common; the size is ViewSpec's.
constexpr const char* kFewFrames = "the first, those at a quarter and a half, the last";
constexpr const char* kFirstFrame = "the first; of several, the first is taken";
constexpr const char* kWholeImage = "1024x1024";
constexpr const char* kVulkanOrCpu = "auto: Vulkan where there is a GPU, else the CPU";

OptionAdder add_command(CLI::App& program, Options& options, const char* name, const char* help,
                        Command command) {
    CLI::App& app = *program.add_subcommand(name, help);
    app.callback([&options, command] { options.command = command; });
    return {app, options};
}

void define_render(CLI::App& program, Options& options) {
    const OptionAdder adder = add_command(
        program, options, "render", "One image per frame, and a contact sheet", Command::kRender);
    add_scene(adder, true);
    add_frames(adder, "all whole frames");
    add_view_options(adder, kWholeImage, "those of --shading lit",
                     {0, "ambient-occlusion rays a camera ray, 0 to 256 (8 with lit, else 16)"});
    add_shading_options(adder);
    add_backend_options(adder, kBackends, kVulkanOrCpu);
    add_tree_options(adder, "auto");
    adder.add_text("--out", "DIR", "folder of the images (out)", options.out);
    adder.add_text("--hits", "FILE", "file of the raw hits of all frames", options.hits);
    add_report_options(adder, true);
}

void define_crosscheck(CLI::App& program, Options& options) {
    const OptionAdder adder = add_command(
        program, options, "crosscheck",
        "Compares every backend and tree with a reference, bit by bit", Command::kCrosscheck);
    add_scenes(adder, "what to trace, one scene after the other");
    add_scene_options(adder);
    add_frames(adder, kFewFrames);
    add_view_options(adder, "256x256", "all three, one after the other");
    add_backend_options(adder, kCheckedBackends, "all", "each");
    adder.add_choice("--devices", "Vulkan devices that are compared (one: that of --device)",
                     kCheckedDevices, options.backend.all_devices);
    add_tree_options(adder, nullptr);
    adder.add_choice("--reference", "reference of the comparison (auto)", kReferences,
                     options.reference);
    adder.add_text("--out", "DIR", "folder of difference images (out/crosscheck)", options.out);
    adder.add_text("--junit", "FILE|-", "a JUnit report; - is stdout", options.junit);
    adder.add_text("--html", "FILE|-", "a page that needs no network; - is stdout", options.html);
    adder.add_text("--bless", "FILE", "file of the images' hashes to write, for --expect",
                   options.bless);
    adder.add_text("--expect", "FILE", "file of --bless that the images must agree with",
                   options.expect);
    adder.add_flag("--strict", "a warning is a failure: exit code 1", options.strict);
    add_report_options(adder, true);
}

void define_diff(CLI::App& program, Options& options) {
    const OptionAdder adder = add_command(
        program, options, "diff",
        "Compares two files of `render --hits`, or two PNG files, bit by bit", Command::kDiff);
    adder.command()
        .add_option("files", options.compared_files, "the expected hits or image, and the other")
        ->type_name("FILE FILE")
        ->expected(2)
        ->required();
    adder.add_text("--out", "DIR", "folder of difference images (none)", options.out);
    adder.add_text("--json", "FILE|-", "a report for programs; - is stdout", options.json);
    adder.add_flag("-q,--quiet", "no result, only the exit code", options.quiet);
}

void define_probe(CLI::App& program, Options& options) {
    const OptionAdder adder = add_command(
        program, options, "probe",
        "One pixel: its ray, its hit and the triangles that it could hit", Command::kProbe);
    add_scene(adder, true);
    adder.command().get_option("scene")->description("what to trace, or a file of --bundle");
    adder.add("--frame", "F", "the frame; not for a bundle",
              [&options](const std::string& option, const std::string& value) {
                  options.frame = parse_finite(option, value, -1e9);
                  options.frame_given = true;
              });
    adder.add("--pixel", "X,Y", "the pixel, from the upper left corner; not for a bundle",
              [&options](const std::string& option, const std::string& value) {
                  options.pixel = parse_pixel(option, value);
                  options.pixel_given = true;
              });
    adder.add_text(
        "--bundle", "FILE.json",
        "file of the ray and its triangles to write, which `probe FILE.json` traces again",
        options.bundle);
    add_view_options(adder, kWholeImage, "primary");
    add_backend_options(adder, kBackends, kVulkanOrCpu);
    add_tree_options(adder, "refit");
    add_report_options(adder, false);
}

void define_profile(CLI::App& program, Options& options) {
    const OptionAdder adder =
        add_command(program, options, "profile", "Times of deforming, refitting, building, tracing",
                    Command::kProfile);
    add_scene(adder, true);
    add_frames(adder, kFewFrames);
    add_view_options(adder, kWholeImage, "primary");
    add_backend_options(adder, kBackends, "auto: the CPU, and Vulkan where there is a device");
    add_tree_options(adder, nullptr);
    adder.add("--repeat", "N", "runs whose median is reported (5)",
              [&options](const std::string& option, const std::string& value) {
                  options.repeat = static_cast<int>(parse_count(option, value, 1, 10000));
              });
    adder.add("--policies", "A,B,...",
              fmt::format("compare update policies over all whole frames: {}", update_forms()),
              [&options](const std::string& option, const std::string& value) {
                  options.policies = parse_updates(option, value);
              });
    adder
        .add("--update", "", "as --policies, for a single policy",
             [&options](const std::string& option, const std::string& value) {
                 options.tree.update = parse_update(option, value);
             })
        ->type_name(update_forms());
    add_update_limits(adder);
    adder.add_text("--trace-events", "FILE|-",
                   "with --policies, the stages in Chrome's trace format", options.trace_events);
    adder.add_text("--plot", "FILE.svg|.png", "with --policies, charts (needs gnuplot)",
                   options.plot);
    adder.add_text("--baseline", "FILE.json",
                   "an earlier --json report; exit code 1 if a stage became slower",
                   options.baseline);
    adder.add("--tolerance", "PERCENT", "by how much a stage may be slower than in --baseline (10)",
              [&options](const std::string& option, const std::string& value) {
                  const bool has_sign = value.ends_with('%');
                  options.tolerance_percent = parse_finite(
                      option, std::string_view(value).substr(0, value.size() - has_sign), 0);
                  options.tolerance_given = true;
              });
    adder.add_text("--csv", "FILE|-", "the table as comma-separated values; - is stdout",
                   options.csv);
    add_report_options(adder, true);
}

void define_trace(CLI::App& program, Options& options) {
    const OptionAdder adder = add_command(program, options, "trace",
                                          "Rays from a file to hits in a file", Command::kTrace);
    add_scene(adder, true);
    adder.command().get_option("--lenient")->description("no effect: trace always is lenient");
    add_frames(adder, kFirstFrame);
    adder
        .add_text("--rays", "FILE|-", "a line `ox oy oz dx dy dz [tnear tfar]` for each ray",
                  options.ray_file)
        ->required();
    adder.add_text("--out", "FILE|-", "a line `H t prim u v` or `M` for each ray", options.out)
        ->required();
    adder.add_flag("--binary", "rays are 8 little-endian floats each", options.binary_rays);
    add_backend_options(adder, kBackends, "cpu; with --device or --validate vulkan");
    adder.add_flag("-q,--quiet", "no effect: trace shows no progress", options.quiet);
}

void define_chart(CLI::App& program, Options& options) {
    const OptionAdder adder =
        add_command(program, options, "chart",
                    "Charts of speed against accuracy, as images and data", Command::kChart);
    add_scenes(adder, "what to trace, at the middle frame");
    adder.add_text("--out", "DIR", "a folder that does not exist yet or is empty", options.out)
        ->required();
    adder.add_flag("--quick", "fewer rays and runs: a minute instead of ten", options.quick);
    add_lenient(adder);
    adder.add_flag("-q,--quiet", "neither result nor progress", options.quiet);
}

void define_info(CLI::App& program, Options& options) {
    const OptionAdder adder =
        add_command(program, options, "info",
                    "Facts about a scene; without a scene, about this program", Command::kInfo);
    add_scene(adder, false);
    add_frames(adder, kFirstFrame);
    adder.add_flag("--bvh", "build the tree both ways and describe it", options.tree_facts);
    add_threads(adder);
    add_report_options(adder, false);
}

void define_devices(CLI::App& program, Options& options) {
    add_report_options(
        add_command(program, options, "devices", "The Vulkan devices", Command::kDevices), false);
}

}  // namespace

void add_commands(CLI::App& program, Options& options) {
    define_render(program, options);
    define_crosscheck(program, options);
    define_diff(program, options);
    define_probe(program, options);
    define_profile(program, options);
    define_trace(program, options);
    define_chart(program, options);
    define_info(program, options);
    define_devices(program, options);
}

}  // namespace mray::app
