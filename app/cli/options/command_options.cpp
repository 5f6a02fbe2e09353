#include "app/cli/options/command_options.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/base/numbers.h"
#include "app/base/update_options.h"
#include "app/cli/options/answer_commands.h"
#include "app/cli/options/option_groups.h"
#include "common/base/errors.h"

namespace mray::app {
namespace {

// Defaults that several commands have in common; the size is ViewSpec's.
constexpr const char* kFewFrames = "the first, those at a quarter and a half, the last";
constexpr const char* kWholeImage = "1024x1024";
constexpr const char* kVulkanOrCpu = "auto: Vulkan where there is a GPU, else the CPU";

// All lines work as they are (test Help.ExamplesWork).
constexpr Example kRenderExamples[] = {
    {"Every eighth frame into the folder cloth",
     "morphray render builtin:cloth --frames 0..24:8 --out cloth"},
    {"One image, quickly", "morphray render builtin:twist --frame 12 --samples 1 --out twist.png"},
    {"Four images of a second of an animation in a glTF file",
     "morphray render scenes/examples/robot.gltf --time 0..0.75:0.25 --out walk"},
};
constexpr Example kViewExamples[] = {
    {"A scene that plays", "morphray view builtin:cloth --play"},
    {"The first complete image of a frame, without anybody to close the window",
     "morphray view builtin:cloth --frame 8 --screenshot cloth.png"},
};
constexpr Example kCrosscheckExamples[] = {
    {"Every backend and tree against brute force, with a page for people",
     "morphray crosscheck builtin:cloth:500 --html crosscheck.html"},
    {"Also the answers to questions about all triangles",
     "morphray crosscheck builtin:spikes --backend cpu --queries 100"},
};
constexpr Example kDiffExamples[] = {
    {"The hits of two devices or machines",
     "morphray render builtin:cloth --frame 8 --hits a.hits -o a.png\n"
     "morphray render builtin:cloth --frame 8 --backend cpu --hits b.hits -o b.png\n"
     "morphray diff a.hits b.hits"},
};
constexpr Example kProbeExamples[] = {
    {"A pixel", "morphray probe builtin:cloth --frame 8 --pixel 512,600"},
};
constexpr Example kProfileExamples[] = {
    {"What a frame costs on the CPU",
     "morphray profile builtin:cloth --backend cpu --frames 0..24:12"},
    {"Update policies side by side, as a table for spreadsheets",
     "morphray profile builtin:twist --policies refit,auto --csv policies.csv"},
};
constexpr Example kChartExamples[] = {
    {"All charts of a scene, with few rays", "morphray chart builtin:cloth --out charts --quick"},
};
constexpr Example kInfoExamples[] = {
    {"A scene and its trees", "morphray info builtin:cloth --bvh"},
    {"This program and its built-in scenes", "morphray info"},
    {"What this build reads and writes", "morphray info --formats"},
};
constexpr Example kDevicesExamples[] = {
    {"Whether each device works", "morphray devices --check"},
    {"All devices, for programs", "morphray devices --json -"},
};

CommandSpec define_render(Options& options) {
    CommandSpec command{"render", "Writes an image of each frame", Command::kRender,
                        kRenderExamples};
    const OptionAdder adder(command, options);
    add_scene(adder, true);
    add_frames(adder, "all whole frames");
    add_view_options(adder, kWholeImage, "those of --shading lit",
                     {0, "ambient-occlusion rays a camera ray, 0 to 256 (8 with lit, else 16)"});
    add_shading_options(adder);
    add_backend_options(adder, kBackends, kVulkanOrCpu);
    add_tree_options(adder, PolicySpec{PolicyKind::kAuto});
    add_skip_existing(adder);
    adder.add_text("-o,--out", "DIR", "folder of the images (out)", options.out);
    adder.add_text("--hits", "FILE|DIR/",
                   "file of the raw hits of all frames, or a folder of a file each frame",
                   options.hits);
    add_report_options(adder, true);
    return command;
}

CommandSpec define_view(Options& options) {
    CommandSpec command{"view", "A window that shows the scene move, and how it is traced",
                        Command::kView, kViewExamples};
    const OptionAdder adder(command, options);
    add_scene(adder, true);
    add_frame(adder, "the frame that is shown first (the first)");
    adder.add_flag("--play", "begin to play at once", options.plays);
    add_view_options(adder, "1280x720", "those of --shading lit",
                     {0, "ambient-occlusion rays a camera ray, 0 to 256 (8 with lit, else 16)"});
    add_shading_options(adder, {false,
                                "camera rays a pixel of a still image (16; 4 with lit and "
                                "--screenshot)"});
    add_backend_options(adder, kBackends, kVulkanOrCpu);
    add_tree_options(adder, PolicySpec{PolicyKind::kAuto});
    // The defaults that are not those of Options, before the command line replaces them.
    command.set_defaults = [&options] {
        options.view.width = 1280;
        options.view.height = 720;
        options.tree.update = PolicySpec{PolicyKind::kAuto};
    };
    adder.add_text("--screenshot", "FILE.png", "write the first complete image, and end",
                   options.screenshot);
    adder.add_flag("-q,--quiet", "no text", options.quiet);
    adder.add_flag("-v,--verbose", "say what is used and decided", options.verbose);
    return command;
}

CommandSpec define_crosscheck(Options& options) {
    CommandSpec command{"crosscheck",
                        "Compares every backend and tree with a reference, bit by bit",
                        Command::kCrosscheck, kCrosscheckExamples};
    const OptionAdder adder(command, options);
    add_scenes(adder, "what to trace, one scene after the other");
    add_file_options(adder);
    add_frames(adder, kFewFrames);
    add_view_options(adder, "256x256", "all three, one after the other");
    add_backend_options(adder, kCheckedBackends, "all", "each");
    adder.add_choice("--devices", "Vulkan devices that are compared (one: that of --device)",
                     kCheckedDevices, options.backend.all_devices);
    add_tree_options(adder, std::nullopt);
    adder.add_choice("--reference", "reference of the comparison (auto)", kReferences,
                     options.reference);
    adder.add("--queries", "N",
              "also compare all hits, windings and closest triangles of N rays and points a frame",
              [&options](const std::string& option, const std::string& value) {
                  options.query_count =
                      static_cast<std::uint32_t>(parse_count(option, value, 1, 1'000'000));
              });
    adder.add_text("--junit", "FILE|-", "a JUnit report; - is stdout", options.junit);
    adder.add_text("--html", "FILE|-", "a page that needs no network; - is stdout", options.html);
    add_report_options(adder, true);
    return command;
}

CommandSpec define_diff(Options& options) {
    CommandSpec command{"diff", "Compares two files bit by bit: hits or PNG", Command::kDiff,
                        kDiffExamples};
    const OptionAdder adder(command, options);
    adder.add_arguments("files", "FILE FILE", "the expected hits or image, and the other",
                        {&options.compared_files, 2});
    adder.add_text("--json", "FILE|-", "a report for programs; - is stdout", options.json);
    adder.add_flag("-q,--quiet", "no result, only the exit code", options.quiet);
    return command;
}

CommandSpec define_probe(Options& options) {
    CommandSpec command{"probe",
                        "Describes one pixel: its ray, its hit, the triangles that it could hit",
                        Command::kProbe, kProbeExamples};
    const OptionAdder adder(command, options);
    add_scene(adder, true);
    add_frame(adder, "the frame");
    adder.add("--pixel", "X,Y", "the pixel, from the upper left corner",
              [&options](const std::string& option, const std::string& value) {
                  options.pixel = parse_pixel(option, value);
                  options.pixel_given = true;
              });
    add_view_options(adder, kWholeImage, "primary");
    add_backend_options(adder, kBackends, kVulkanOrCpu);
    add_tree_options(adder, PolicySpec{PolicyKind::kRefit});
    add_report_options(adder, false);
    return command;
}

CommandSpec define_profile(Options& options) {
    CommandSpec command{"profile", "Measures deforming, refitting, building and tracing",
                        Command::kProfile, kProfileExamples};
    const OptionAdder adder(command, options);
    add_scene(adder, true);
    add_frames(adder, kFewFrames);
    add_view_options(adder, kWholeImage, "primary");
    add_backend_options(adder, kProfiledBackends,
                        "auto: the CPU, and Vulkan where there is a device");
    add_tree_options(adder, std::nullopt);
    adder.add("--repeat", "N", "runs whose median is reported (10; with --policies or --update 5)",
              [&options](const std::string& option, const std::string& value) {
                  options.repeat = static_cast<int>(parse_count(option, value, 1, 10000));
              });
    adder.add("--policies", update_forms() + ",...",
              "update policies to compare, over all whole frames",
              [&options](const std::string& option, const std::string& value) {
                  options.policies = parse_updates(option, value);
              });
    adder.add("--update", update_forms(), "as --policies, for a single policy",
              [&options](const std::string& option, const std::string& value) {
                  options.tree.update = parse_update(option, value);
              });
    add_update_limits(adder);
    adder.add_text("--plot", "FILE.svg|.png", "with --policies, charts (needs gnuplot)",
                   options.plot);
    adder.add_text("--baseline", "FILE.json",
                   "an earlier --json report; exit code 1 if a stage became slower",
                   options.baseline);
    adder.add("--tolerance", "PERCENT", "by how much a stage may be slower than in --baseline (5)",
              [&options](const std::string& option, const std::string& value) {
                  const bool has_sign = value.ends_with('%');
                  options.tolerance_percent = parse_finite(
                      option, std::string_view(value).substr(0, value.size() - has_sign), 0);
                  options.tolerance_given = true;
              });
    adder.add_text("--csv", "FILE|-", "the table as comma-separated values; - is stdout",
                   options.csv);
    add_report_options(adder, true);
    return command;
}

CommandSpec define_chart(Options& options) {
    CommandSpec command{"chart", "Draws charts of speed against accuracy, as images and data",
                        Command::kChart, kChartExamples};
    const OptionAdder adder(command, options);
    add_scenes(adder, "what to trace, at the middle frame");
    adder.add_text("-o,--out", "DIR", "a folder that does not exist yet or is empty", options.out)
        .required = true;
    adder.add_flag("--quick", "fewer rays and runs: a minute instead of ten", options.quick);
    add_lenient(adder);
    add_progress(adder);
    adder.add_flag("-q,--quiet", "neither result nor progress", options.quiet);
    return command;
}

CommandSpec define_info(Options& options) {
    CommandSpec command{"info", "Describes a scene; without a scene, this program", Command::kInfo,
                        kInfoExamples};
    const OptionAdder adder(command, options);
    add_scene(adder, false);
    add_frame(adder, kFirstFrame);
    adder.add_flag("--bvh", "build the tree both ways and describe it", options.tree_facts);
    adder.add_flag("--formats", "list the formats of files that are read and written",
                   options.formats);
    add_threads(adder);
    add_report_options(adder, false);
    return command;
}

CommandSpec define_devices(Options& options) {
    CommandSpec command{"devices", "Lists the Vulkan devices, and tests them", Command::kDevices,
                        kDevicesExamples};
    const OptionAdder adder(command, options);
    adder.add_flag("--check", "compare rays, shading and refit of each device with the CPU's",
                   options.checks_devices);
    add_report_options(adder, false);
    return command;
}

}  // namespace

std::vector<CommandSpec> command_specs(Options& options) {
    std::vector<CommandSpec> commands;
    for (const auto define :
         {define_render, define_view, define_crosscheck, define_diff, define_probe, define_profile,
          define_trace, define_query, define_chart, define_info, define_devices})
        commands.push_back(define(options));
    return commands;
}

}  // namespace mray::app
