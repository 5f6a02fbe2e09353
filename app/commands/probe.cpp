// morphray probe: traces one pixel and describes how its result comes about.
#include <cstring>

#include "app/animation/animation_scene.h"
#include "app/commands/commands.h"
#include "common/interop/hit_rule.h"
#include "common/interop/surface.h"
#include "library/src/engine.h"
#include "report/table.h"

namespace mray::app {
namespace {

namespace engine = morphray::engine;

constexpr std::size_t kCandidates = 8;

struct Candidate {
    /// True if the hit rule counts `hit` as a hit.
    bool is_hit = false;
    Hit hit;
    /// Edge functions of the projected vertices; inside the triangle all have one sign.
    Edges edges = {};
    bool inside = false;
    /// The conditions that do not hold; of a hit none may be among them.
    std::string fails;
};

Candidate test_triangle(const Ray& ray, const ShearedRay& sheared, const SlabRay& slab,
                        std::uint32_t prim_id, vec3 a, vec3 b, vec3 c) {
    Candidate result;
    TriangleHit hit;
    result.is_hit = intersect_triangle(sheared, ray.tnear, ray.tfar, a, b, c, hit);
    result.hit = {hit.t, hit.u, hit.v, prim_id};
    result.edges = exact_edges(project(sheared, a), project(sheared, b), project(sheared, c));
    result.inside = may_be_inside(result.edges);
    Box bounds;
    for (const vec3 vertex : {a, b, c}) bounds.extend(vertex);
    const Box box = padded(bounds);
    float t_least = 0;
    const bool meets_box =
        hits_box(slab, box.lower, box.upper, t_least) && t_least <= last_depth(hit.t);
    for (const auto& [holds, name] :
         {std::pair(result.inside, "inside"), std::pair(has_area(a, b, c), "area"),
          std::pair(is_in_range(hit.t, ray.tnear, ray.tfar), "range"),
          std::pair(finite_vertices(a, b, c), "finite"), std::pair(meets_box, "box"),
          std::pair(may_hit_triangle(sheared, a, b, c), "filter")})
        if (!holds) result.fails += std::string(result.fails.empty() ? "" : " ") + name;
    return result;
}

bool before(const Candidate& a, const Candidate& b) {
    if (a.is_hit != b.is_hit) return a.is_hit;
    if (a.inside != b.inside) return a.inside;
    return is_closer(a.hit.t, a.hit.prim_id, b.hit.t, b.hit.prim_id);
}

/// Tests all triangles by brute force. Returns the hits, nearest first, then those that the fast
/// filter keeps, at most kCandidates; and in addition those of `wanted`.
std::vector<Candidate> find_candidates(const Ray& ray, const Topology& topology,
                                       std::span<const vec3> positions,
                                       std::span<const std::uint32_t> wanted) {
    if (ray.dir == vec3(0, 0, 0)) return {};
    const ShearedRay sheared = shear_ray(ray.org, ray.dir);
    const SlabRay slab = slab_ray(ray.org, ray.dir);
    const auto is_wanted = [&](std::uint32_t id) {
        return std::ranges::find(wanted, id) != wanted.end();
    };
    std::vector<Candidate> found;
    for (std::uint32_t id = 0; id < topology.triangles.size(); ++id) {
        const uvec3 corners = topology.triangles[id];
        const vec3 a = positions[corners.x];
        const vec3 b = positions[corners.y];
        const vec3 c = positions[corners.z];
        if (is_wanted(id) || may_hit_triangle(sheared, a, b, c))
            found.push_back(test_triangle(ray, sheared, slab, id, a, b, c));
    }
    std::sort(found.begin(), found.end(), before);
    std::size_t kept = 0;
    std::erase_if(found, [&](const Candidate& c) {
        return !is_wanted(c.hit.prim_id) && ++kept > kCandidates;
    });
    return found;
}

// Every bit, and a number to read.
std::string both(float x) { return fmt::format("{} ({:.6g})", hex_text(x), x); }

std::string hex_point(vec3 p) {
    return fmt::format("{}  {}  {}", hex_text(p.x), hex_text(p.y), hex_text(p.z));
}

std::string point(vec3 p) {
    return fmt::format("{}\n         ({:.6g}, {:.6g}, {:.6g})", hex_point(p), p.x, p.y, p.z);
}

/// `world_depth` is the depth along the viewing direction in world space for t = 1.
std::string hit_text(const char* name, const Hit& hit, double world_depth) {
    if (hit.prim_id == kNoPrim) return fmt::format("{:<22}miss\n", name);
    return fmt::format("{:<22}prim {}, depth {:.9g} in world space\n  t {}\n  u {}  v {}\n", name,
                       hit.prim_id, hit.t * world_depth, both(hit.t), both(hit.u), both(hit.v));
}

/// `world_org` has the file's coordinates.
std::string ray_text(const Ray& ray, const glm::dvec3& world_org, int digits, double world_depth) {
    std::string text = "ray in scene space\n";
    text += "  org    " + point(ray.org) + "\n  dir    " + point(ray.dir) + "\n";
    text += fmt::format("  tnear  {}\n  tfar   {}\n", both(ray.tnear), both(ray.tfar));
    return text + fmt::format(
                      "ray in world space\n  org    ({1:.{0}g}, {2:.{0}g}, {3:.{0}g})\n"
                      "  depth of t = 1   {4:.9g}\n",
                      digits, world_org.x, world_org.y, world_org.z, world_depth);
}

/// Traces the shadow ray or the ambient-occlusion rays of a hit, and describes their hits.
std::string secondary_text(const ImageParams& params, const Surface& surface, Pixel pixel,
                           Backend& backend) {
    std::vector<Ray> rays;
    if (params.rays == kRaysShadow) {
        if (!faces_light(surface, params.light))
            return "  the surface faces away from the light: in shadow without a ray\n";
        rays.push_back(shadow_ray(surface, params.light));
    } else {
        for (std::uint32_t i = 0; i < params.ao_count; ++i)
            rays.push_back(ao_ray(surface, pixel.x, pixel.y, i, params.ao_tfar));
    }
    std::vector<Hit> hits(rays.size());
    backend.trace({rays, hits});
    std::string text;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const std::string hit =
            hits[i].prim_id == kNoPrim
                ? std::string("free")
                : fmt::format("prim {} at t {}", hits[i].prim_id, hex_text(hits[i].t));
        text += fmt::format("  {:<3}  org {}\n       dir {}\n       tfar {}  {}\n", i,
                            hex_point(rays[i].org), hex_point(rays[i].dir), hex_text(rays[i].tfar),
                            hit);
    }
    return text;
}

std::string candidates_text(const std::vector<Candidate>& candidates) {
    if (candidates.empty()) return "no triangle comes near\n";
    Table table({"prim", "result", "t", "edge U", "edge V", "edge W", "fails"});
    for (const Candidate& c : candidates) {
        const char* const hit = &c == &candidates.front() ? "wins" : "hit";
        table.add({fmt::format("{}", c.hit.prim_id), c.is_hit ? hit : "no hit", hex_text(c.hit.t),
                   hex_text(c.edges.u), hex_text(c.edges.v), hex_text(c.edges.w), c.fails});
    }
    return "triangles by brute force, the answer first; and the conditions that fail\n" +
           table.text();
}

std::string text_of(const Hit& hit) {
    if (hit.prim_id == kNoPrim) return "nothing";
    return fmt::format("triangle {} at t {}", hit.prim_id, hex_text(hit.t));
}

}  // namespace

std::string probe_sentence(const Hit& image, const Hit& alone, const Hit& brute, double distance) {
    const auto differs = [&](const Hit& hit) {
        return std::memcmp(&hit, &image, sizeof(hit)) != 0;
    };
    if (differs(alone) || differs(brute))
        return fmt::format("DIFFERENT: the image has {}, the ray alone {}, brute force {}",
                           text_of(image), text_of(alone), text_of(brute));
    if (image.prim_id == kNoPrim) return "nothing; all agree";
    return fmt::format("triangle {}, {:.3g} away; all agree", image.prim_id, distance);
}

ExitCode run_probe(const Options& options, const Messages& messages) {
    const Pixel pixel = options.pixel;
    if (pixel.x >= options.view.width || pixel.y >= options.view.height)
        throw Error(ErrorKind::kBadArgument,
                    "--pixel: {},{} is not in an image of {}x{}; choose one from 0,0 to {},{}, or "
                    "another --size",
                    pixel.x, pixel.y, options.view.width, options.view.height,
                    options.view.width - 1, options.view.height - 1);
    const PosedAnimation posed = pose_animation(options, messages);
    const Animation& animation = *posed.animation;
    posed.scene->advance(*options.frame);
    const morphray::Scene& scene = posed.scene->scene();
    Backend& tracer = engine::backend(scene);
    const ImageParams params = engine::image_params(scene, world_view(options.view, animation));
    std::optional<Progress> progress(std::in_place, "tracing the image", 0, messages);
    Frame frame;
    tracer.trace_image(params, frame);
    progress.emplace("testing all triangles", 0, messages);

    const std::size_t index = std::size_t{pixel.y} * params.width + pixel.x;
    const Hit image = frame.hits[index];
    const std::uint32_t colour = frame.pixels[index];
    const Ray ray = camera_ray(params.camera, pixel.x, pixel.y);
    Hit alone;
    tracer.trace({{&ray, 1}, {&alone, 1}});
    const std::span<const vec3> positions = engine::positions(scene);
    const std::uint32_t wanted[] = {image.prim_id, alone.prim_id};
    const std::vector<Candidate> candidates =
        find_candidates(ray, animation.topology(), positions, wanted);
    const bool brute_hits = !candidates.empty() && candidates.front().is_hit;
    const SceneSpace& space = engine::space(scene);
    const double world_depth =
        space.length_to_world(camera_depth_scale(params.camera, pixel.x, pixel.y));
    const auto tree = call_library([&] { return scene.tree_statistics(); });

    std::string text = probe_sentence(
        image, alone, brute_hits ? candidates.front().hit : no_hit(),
        std::ldexp(image.t * std::hypot(ray.dir.x, ray.dir.y, ray.dir.z), -space.exponent()));
    text += fmt::format("\n{}, frame {}, pixel {},{} of {}x{}, {} rays\nbackend {}: {}\n",
                        animation.name(), *options.frame, pixel.x, pixel.y, params.width,
                        params.height, name_of_rays(options.view.rays), scene.device().name(),
                        scene.device().description());
    text += fmt::format(
        "tree    {}: {} nodes, {} leaves, depth {}, SAH cost {:.3f}\n        hash {}\n\n",
        to_string(posed.scene->update().step), tree.node_count, tree.leaf_count, tree.depth,
        tree.sah_cost, hash_text(tree.hash));
    const Origin origin = animation.origin();
    const glm::dvec3 org = origin.from_world(glm::dvec3(space.to_world(ray.org)));
    text += ray_text(ray, org, origin.digits(), world_depth) + "\n";
    text += hit_text("hit in the image", image, world_depth);
    text += hit_text("hit of the ray alone", alone, world_depth);
    text += fmt::format("colour                #{:02x}{:02x}{:02x}\n", colour & 0xFF,
                        (colour >> 8) & 0xFF, (colour >> 16) & 0xFF);
    if (params.rays != kRaysPrimary)
        text +=
            fmt::format("secondary rays        {} occluded in the image\n", frame.occlusion[index]);
    if (params.rays != kRaysPrimary && alone.prim_id != kNoPrim) {
        const uvec3 corners = animation.topology().triangles[alone.prim_id];
        const Surface surface = surface_at(ray, alone, positions[corners.x], positions[corners.y],
                                           positions[corners.z]);
        text += secondary_text(params, surface, pixel, tracer);
    }
    messages.print(text + "\n" + candidates_text(candidates));
    return ExitCode::kOk;
}

}  // namespace mray::app
