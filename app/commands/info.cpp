// morphray info: describes a scene, or this program.
#include "app/animation/animation_scene.h"
#include "app/animation/devices.h"
#include "app/animation/frames.h"
#include "app/commands/commands.h"
#include "app/report/json_parts.h"
#include "library/src/engine.h"
#include "report/table.h"
#include "scenes/procedural/procedural.h"

namespace mray::app {
namespace {

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
        kVersionDetail, kCompiler, names_of(supported_simd_targets()), describe_vulkan());
    Table table({"  name", "triangles", "what"});
    for (const ProceduralScene& scene : procedural_scenes())
        table.add({fmt::format("  builtin:{}", scene.name),
                   fmt::format("{}", scene.default_triangles), std::string(scene.description)});
    return text + "\nbuilt-in scenes\n" + table.text();
}

Json describe_tree(const AnimationScene& scene) {
    const Bvh& bvh = morphray::engine::backend(scene.scene()).host_tree();
    const BvhStats stats = bvh_stats(bvh);
    return {{"build_ms", scene.update().rebuild_ms},
            {"bvh_hash", hash_text(bvh_hash(bvh))},
            {"sah_cost", stats.sah_cost},
            {"nodes", stats.node_count},
            {"leaves", stats.leaf_count},
            {"depth", stats.depth},
            {"children_per_node", stats.children_per_node},
            {"triangles_per_leaf", stats.triangles_per_leaf},
            {"vertices_per_leaf", stats.vertices_per_leaf},
            {"bytes", stats.bytes}};
}

Json describe_scene(const Options& options, const Messages& messages) {
    const std::unique_ptr<Animation> opened = open_animation(options.source, messages);
    const Animation& animation = *opened;
    const Topology& topology = animation.topology();
    const double frame = select_frame(options, animation);
    std::vector<vec3> positions(topology.vertex_count);
    animation.positions(frame, positions);
    const std::uint64_t not_finite = count_not_finite(topology, positions);
    const PoseExtent pose(positions, used_vertices(topology));
    const SceneSpace space = space_of_pose(animation.bounds(), pose);
    if (const std::uint64_t far = pose.count_beyond(space.limit()); far > 0)
        messages.warn(warning_of_far(animation, far));
    space.to_scene(positions, positions);
    const DegenerateCount degenerate = count_degenerate(topology, positions);
    Json json = head_of("info", animation);
    json["first_frame"] = animation.first_frame();
    json["last_frame"] = animation.last_frame();
    json["fps"] = nullptr;
    if (animation.fps()) json["fps"] = *animation.fps();
    json["bounds"] = nullptr;
    const Origin origin = animation.origin();
    if (const WorldBounds bounds = animation.bounds(); !bounds.empty()) {
        const auto corner = [&](const glm::dvec3& p) {
            const glm::dvec3 file = origin.from_world(p);
            return Json{file.x, file.y, file.z};
        };
        json["bounds"] = {{"lower", corner(bounds.lower)}, {"upper", corner(bounds.upper)}};
    }
    json["origin"] = {origin.at.x, origin.at.y, origin.at.z};
    json["scene_exponent"] = space.exponent();
    json["not_finite"] = not_finite;
    json["too_far"] = degenerate.left_out - not_finite;
    json["zero_area"] = degenerate.zero_area;
    const EdgeCounts edges = count_edges(topology, positions);
    json["edges"] = {{"open", edges.open},
                     {"shared", edges.shared},
                     {"turned", edges.turned},
                     {"uneven", edges.uneven},
                     {"twins", edges.twins}};
    json["topology_hash"] = hash_text(topology_hash(topology));
    json["textures"] = Json::array();
    json["textured_triangles"] = 0;
    if (const SceneTextures* const textures = animation.textures()) {
        for (const TextureFile& file : textures->files)
            json["textures"].push_back(escape(std::filesystem::path(file.path).filename()));
        json["textured_triangles"] = std::ranges::count_if(
            textures->texture_ids, [](std::uint32_t id) { return id != kNoTexture; });
    }
    json["animations"] = Json::array();
    for (const NamedAnimation& named : animation.animations())
        json["animations"].push_back({{"index", json["animations"].size()},
                                      {"name", named.name},
                                      {"shown", named.is_shown}});
    if (!options.tree_facts && !options.crossing_count) return json;
    const AnimationScene scene(morphray::Device::cpu(), {.view = {}}, animation, frame, messages);
    if (options.tree_facts) json["tree"] = describe_tree(scene);
    if (options.crossing_count)
        json["crossings"] = call_library([&] {
            return scene.scene().crossings({.limit = 0}, {.cancel = &interrupt_flag()}).left_out;
        });
    return json;
}

std::string text_of_point(const Json& point, int digits) {
    const auto [x, y, z] = point.get<Point>();
    return fmt::format("{:.{}g}, {:.{}g}, {:.{}g}", x, digits, y, digits, z, digits);
}

std::string scene_text_of(const Json& json) {
    const double last = json["last_frame"];
    std::string text;
    const auto add = [&text](const char* name, const std::string& value) {
        constexpr std::size_t kIndent = 16;
        const bool is_long = kIndent + value.size() > kColumns;
        text += fmt::format("{:<15} {}\n", name,
                            is_long ? wrapped(value, kIndent, kColumns - kIndent) : value);
    };
    add("scene", json["scene"]);
    add("triangles",
        fmt::format("{} ({} without area, {} not finite, {} too far)", json["triangles"].dump(),
                    json["zero_area"].dump(), json["not_finite"].dump(), json["too_far"].dump()));
    add("vertices", json["vertices"].dump());
    const Json& edges = json["edges"];
    add("edges", describe(EdgeCounts{edges["open"], edges["shared"], edges["turned"],
                                     edges["uneven"], edges["twins"]}));
    if (json.contains("crossings"))
        add("crossings", json["crossings"].dump() + " pairs of triangles");
    std::string frames = fmt::format("{} to {}", json["first_frame"].get<double>(), last);
    if (const Json& fps = json["fps"]; !fps.is_null())
        frames +=
            fmt::format(" ({:.6g} s, {} a second)", last / fps.get<double>(), fps.get<double>());
    add("frames", frames);
    const Json& bounds = json["bounds"];
    const bool has_origin = json["origin"] != Json{0.0, 0.0, 0.0};
    const int digits = has_origin ? 12 : 6;
    add("bounds", bounds.is_null()
                      ? "none"
                      : fmt::format("({}) to ({})", text_of_point(bounds["lower"], digits),
                                    text_of_point(bounds["upper"], digits)));
    if (has_origin) add("origin", text_of_point(json["origin"], digits));
    add("scene space", "world space * 2^" + json["scene_exponent"].dump());
    add("topology hash", json["topology_hash"]);
    if (!json["textures"].empty())
        add("textures",
            fmt::format("{} ({} triangles): {}", json["textures"].size(),
                        json["textured_triangles"].dump(),
                        fmt::join(json["textures"].get<std::vector<std::string>>(), ", ")));
    for (const Json& animation : json["animations"]) {
        const std::string name = animation["name"];
        add("animation", animation["index"].dump() + (name.empty() ? "" : ' ' + quote(name)) +
                             (animation["shown"] ? ", shown" : ""));
    }
    if (!json.contains("tree")) return text;
    const Json& tree = json["tree"];
    const auto number = [&](const char* key) { return tree[key].get<double>(); };
    text += '\n';
    add("tree", fmt::format("built in {:.2f} ms, {:.2f} MiB", number("build_ms"),
                            number("bytes") / 0x1p20));
    add("SAH cost", fmt::format("{:.3f} (estimate of what a ray costs)", number("sah_cost")));
    add("nodes", fmt::format("{}, {:.2f} children each, depth {}", number("nodes"),
                             number("children_per_node"), number("depth")));
    add("leaves", fmt::format("{}, {:.2f} triangles and {:.2f} vertices each", number("leaves"),
                              number("triangles_per_leaf"), number("vertices_per_leaf")));
    add("tree hash", tree["bvh_hash"]);
    return text;
}

}  // namespace

ExitCode run_info(const Options& options, const Messages& messages) {
    check_reports({options.json});
    if (options.source.scene.empty()) {
        messages.print(describe_program());
        return ExitCode::kOk;
    }
    const Json report = describe_scene(options, messages);
    return write_reports(ExitCode::kOk, messages,
                         {{options.json, [&] { return json_text(report); }}},
                         [&] { return scene_text_of(report); });
}

}  // namespace mray::app
