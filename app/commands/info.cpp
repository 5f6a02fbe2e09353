// morphray info: describes a scene, or this program.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "app/backends/backends.h"
#include "app/base/choices.h"
#include "app/clip/frames.h"
#include "app/commands/commands.h"
#include "app/report/json_parts.h"
#include "common/base/stopwatch.h"
#include "common/report/table.h"
#include "common/scene/mesh.h"
#include "common/scene/mesh_edges.h"
#include "common/simd/simd_target.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"
#include "common/version.h"
#include "scenes/procedural/procedural.h"

namespace mray::app {
namespace {

struct SceneReport {
    ReportHead head;
    double first_frame = 0;
    double last_frame = 0;
    /// Frames a second, if the scene has seconds.
    std::optional<double> fps;
    std::vector<ClipAnimation> animations;
    WorldBounds bounds;
    int exponent = 0;
    DegenerateCount degenerate;
    EdgeCounts edges;
    std::uint64_t topology_hash = 0;
    /// File names, and the number of triangles that show one of them.
    std::vector<std::string> textures;
    std::uint64_t textured_triangles = 0;
    struct Tree {
        std::string build;
        double build_ms = 0;
        BvhStats stats;
        std::uint64_t bvh_hash = 0;
    };
    std::vector<Tree> trees;
};

std::string to_json(const SceneReport& report) {
    Json json = head_of(report.head);
    json["first_frame"] = report.first_frame;
    json["last_frame"] = report.last_frame;
    json["fps"] = nullptr;
    if (report.fps) json["fps"] = *report.fps;
    if (report.bounds.empty()) {
        json["bounds"] = nullptr;
    } else {
        json["bounds"] = {{"lower", std::to_array(report.bounds.lower)},
                          {"upper", std::to_array(report.bounds.upper)}};
    }
    json["scene_exponent"] = report.exponent;
    json["not_finite"] = report.degenerate.not_finite;
    json["zero_area"] = report.degenerate.zero_area;
    json["edges"] = {{"open", report.edges.open},
                     {"shared", report.edges.shared},
                     {"turned", report.edges.turned},
                     {"uneven", report.edges.uneven}};
    json["topology_hash"] = hash_text(report.topology_hash);
    json["textures"] = report.textures;
    json["textured_triangles"] = report.textured_triangles;
    json["animations"] = Json::array();
    for (std::size_t i = 0; i < report.animations.size(); ++i) {
        const ClipAnimation& animation = report.animations[i];
        json["animations"].push_back(
            {{"index", i}, {"name", animation.name}, {"shown", animation.is_shown}});
    }
    json["trees"] = Json::array();
    for (const SceneReport::Tree& tree : report.trees) {
        Json row = {{"build", tree.build},
                    {"build_ms", tree.build_ms},
                    {"bvh_hash", hash_text(tree.bvh_hash)}};
        row.update(of(tree.stats));
        json["trees"].push_back(row);
    }
    return json_text(json);
}

std::string build_description() {
#ifdef NDEBUG
    constexpr const char* kAssertions = "without";
#else
    constexpr const char* kAssertions = "with";
#endif
    return fmt::format("{}, {} assertions", kCompiler, kAssertions);
}

std::string describe_vulkan() {
    try {
        std::size_t usable = 0;
        for (const morphray::VulkanDeviceInfo& device : vulkan_devices())
            usable += device.unusable.empty();
        return fmt::format("Vulkan: {} usable device{}", usable, usable == 1 ? "" : "s");
    } catch (const Error& error) {
        // The message begins with "Vulkan".
        return error.what();
    }
}

std::string describe_program() {
    std::string text = fmt::format(
        "morphray {}, {}\n\nbackends\n  cpu: {}\n  brute: every ray against every triangle\n  {}\n",
        kVersionDetail, build_description(), names_of(supported_simd_targets()), describe_vulkan());
    Table table({"  name", "triangles", "what"});
    for (const ProceduralScene& scene : procedural_scenes())
        table.add({fmt::format("  builtin:{}", scene.name),
                   fmt::format("{}", scene.default_triangles), std::string(scene.description)});
    return text + "\nbuilt-in scenes\n" + table.text();
}

SceneReport::Tree describe_tree(SplitMethod split, const Topology& topology,
                                std::span<const vec3> positions) {
    SceneReport::Tree tree;
    tree.build = name_in<SplitMethod>(kSplits, split);
    const Stopwatch watch;
    const Bvh bvh = build_bvh(topology, positions, {.split = split});
    tree.build_ms = watch.ms();
    tree.stats = bvh_stats(bvh);
    tree.bvh_hash = bvh_hash(bvh);
    return tree;
}

SceneReport describe_scene(const InfoOptions& options, const Messages& messages) {
    SceneFrames scene(open_clip(options.source, messages));
    const Topology& topology = scene.clip().topology();
    const double frame = select_frame(options.frame, std::nullopt, scene.clip());
    const std::span<const vec3> positions = scene.positions(frame);
    SceneReport report;
    report.head.command = "info";
    report.head.scene = scene.clip().name();
    report.head.triangles = topology.triangles.size();
    report.head.vertices = topology.vertex_count;
    report.first_frame = scene.clip().first_frame();
    report.last_frame = scene.clip().last_frame();
    report.fps = scene.clip().fps();
    const std::span<const ClipAnimation> animations = scene.clip().animations();
    report.animations.assign(animations.begin(), animations.end());
    report.bounds = scene.clip().bounds();
    report.exponent = scene.space().exponent();
    report.degenerate = count_degenerate(topology, positions);
    report.edges = count_edges(topology, positions);
    report.topology_hash = topology_hash(topology);
    if (const SceneTextures* textures = scene.clip().textures()) {
        for (const TextureFile& file : textures->files)
            report.textures.push_back(escape(std::filesystem::path(file.path).filename()));
        report.textured_triangles = static_cast<std::uint64_t>(
            std::count_if(textures->texture_ids.begin(), textures->texture_ids.end(),
                          [](std::uint32_t id) { return id != kNoTexture; }));
    }
    if (options.tree_facts) {
        for (const SplitMethod split : {SplitMethod::kBinned, SplitMethod::kSweep}) {
            report.trees.push_back(describe_tree(split, topology, positions));
        }
    }
    return report;
}

std::string table_of(const std::vector<ClipAnimation>& animations) {
    Table table({"animation", "name", "shown"});
    for (std::size_t i = 0; i < animations.size(); ++i) {
        const ClipAnimation& animation = animations[i];
        table.add({fmt::format("{}", i), animation.name.empty() ? "" : quote(animation.name),
                   animation.is_shown ? "yes" : ""});
    }
    return table.text();
}

std::string text_of(const SceneReport& report) {
    const auto corner = [](const double p[3]) {
        return fmt::format("{:.6g}, {:.6g}, {:.6g}", p[0], p[1], p[2]);
    };
    std::string text = fmt::format("scene           {}\n", report.head.scene);
    text +=
        fmt::format("triangles       {} ({} without area, {} not finite)\n", report.head.triangles,
                    report.degenerate.zero_area, report.degenerate.not_finite);
    text += fmt::format("vertices        {}\n", report.head.vertices);
    text += fmt::format("edges           {}\n", describe(report.edges));
    text += fmt::format("frames          {} to {}", report.first_frame, report.last_frame);
    text += report.fps ? fmt::format(" ({:.6g} s, {} a second)\n", report.last_frame / *report.fps,
                                     *report.fps)
                       : "\n";
    text += report.bounds.empty()
                ? "bounds          none\n"
                : fmt::format("bounds          ({}) to ({})\n", corner(report.bounds.lower),
                              corner(report.bounds.upper));
    text += fmt::format("scene space     world space * 2^{}\n", report.exponent);
    text += fmt::format("topology hash   {}\n", hash_text(report.topology_hash));
    if (!report.textures.empty()) {
        text += fmt::format("textures        {} ({} triangles): {}\n", report.textures.size(),
                            report.textured_triangles, fmt::join(report.textures, ", "));
    }
    if (!report.animations.empty()) text += "\n" + table_of(report.animations);
    if (report.trees.empty()) return text;
    Table table({"tree", "build ms", "SAH cost", "nodes", "leaves", "depth", "children",
                 "triangles", "vertices", "MiB", "hash"});
    for (const SceneReport::Tree& tree : report.trees) {
        const BvhStats& s = tree.stats;
        table.add({tree.build, fmt::format("{:.2f}", tree.build_ms),
                   fmt::format("{:.3f}", s.sah_cost), fmt::format("{}", s.node_count),
                   fmt::format("{}", s.leaf_count), fmt::format("{}", s.depth),
                   fmt::format("{:.2f}", s.children_per_node),
                   fmt::format("{:.2f}", s.triangles_per_leaf),
                   fmt::format("{:.2f}", s.vertices_per_leaf),
                   fmt::format("{:.2f}", static_cast<double>(s.bytes) / 0x1p20),
                   hash_text(tree.bvh_hash)});
    }
    return text + "\n" + table.text();
}

}  // namespace

ExitCode run_command(const InfoOptions& options, const Messages& messages) {
    check_reports({options.json});
    if (options.source.scene.empty()) {
        messages.print(describe_program());
        return ExitCode::kOk;
    }
    const SceneReport report = describe_scene(options, messages);
    if (!options.json.empty()) write_report(options.json, to_json(report));
    if (!takes_stdout({options.json})) messages.print(text_of(report));
    return ExitCode::kOk;
}

}  // namespace mray::app
