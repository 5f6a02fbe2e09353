#include <CLI/CLI.hpp>
#include <algorithm>
#include <limits>

#include "app/cli/option_groups.h"
#include "common/text/text.h"

namespace mray::app {
namespace {

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

}  // namespace

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

}  // namespace mray::app
