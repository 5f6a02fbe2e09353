#include "app/commands/pixel_probe.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "app/backends/backends.h"
#include "app/clip/frames.h"
#include "app/terminal/progress.h"
#include "common/base/errors.h"
#include "common/bvh/box.h"
#include "common/interop/camera.h"
#include "common/interop/hit_rule.h"
#include "common/interop/surface.h"
#include "common/scene/mesh.h"
#include "common/update/tree_updater.h"

namespace mray::app {
namespace {

Candidate test_triangle(const Ray& ray, const ShearedRay& sheared, const SlabRay& slab, vec3 a,
                        vec3 b, vec3 c) {
    const Edges edges = exact_edges(project(sheared, a), project(sheared, b), project(sheared, c));
    TriangleHit hit;
    const bool is_hit = intersect_triangle(sheared, ray.tnear, ray.tfar, a, b, c, hit);
    Candidate result;
    result.t = hit.t;
    result.u = hit.u;
    result.v = hit.v;
    result.edge_u = edges.u;
    result.edge_v = edges.v;
    result.edge_w = edges.w;
    result.may_hit = may_hit_triangle(sheared, a, b, c);
    result.inside = may_be_inside(edges);
    result.has_area = has_area(a, b, c);
    result.in_range = is_in_range(hit.t, ray.tnear, ray.tfar);
    result.finite = finite_vertices(a, b, c);
    Box bounds;
    for (const vec3 vertex : {a, b, c}) bounds.extend(vertex);
    const Box box = padded(bounds);
    result.meets_box = hits_box(slab, box.lower, box.upper, result.t_least) &&
                       result.t_least <= last_depth(result.t);
    result.is_hit = is_hit;
    return result;
}

bool before(const Candidate& a, const Candidate& b) {
    if (a.is_hit != b.is_hit) return a.is_hit;
    if (a.inside != b.inside) return a.inside;
    return is_closer(a.t, a.prim_id, b.t, b.prim_id);
}

/// Tests all triangles (positions in scene space) by brute force. Returns the hits from the nearest
/// to the farthest, so that the first is the answer, then triangles that the fast filter keeps; at
/// most `limit` triangles, and in addition those of `wanted`.
std::vector<Candidate> find_candidates(const Ray& ray, const Topology& topology,
                                       std::span<const vec3> positions, std::size_t limit,
                                       std::span<const std::uint32_t> wanted) {
    if (ray.dir == vec3(0, 0, 0)) return {};
    const ShearedRay sheared = shear_ray(ray.org, ray.dir);
    const SlabRay slab = slab_ray(ray.org, ray.dir);
    std::vector<Candidate> found;
    std::vector<Candidate> extra;
    for (std::uint32_t id = 0; id < topology.triangles.size(); ++id) {
        const uvec3 corners = topology.triangles[id];
        const vec3 a = positions[corners.x];
        const vec3 b = positions[corners.y];
        const vec3 c = positions[corners.z];
        const bool is_wanted = std::find(wanted.begin(), wanted.end(), id) != wanted.end();
        if (!is_wanted && !may_hit_triangle(sheared, a, b, c)) continue;
        Candidate candidate = test_triangle(ray, sheared, slab, a, b, c);
        candidate.prim_id = id;
        (is_wanted ? extra : found).push_back(candidate);
    }
    std::sort(found.begin(), found.end(), before);
    if (found.size() > limit) found.resize(limit);
    found.insert(found.end(), extra.begin(), extra.end());
    std::sort(found.begin(), found.end(), before);
    return found;
}

constexpr std::size_t kCandidates = 8;

void require_pixel(const ProbeOptions& options) {
    const Pixel p = options.pixel;
    const ViewSpec& view = options.view;
    if (p.x < view.width && p.y < view.height) return;
    throw Error(ErrorKind::kBadArgument,
                fmt::format("--pixel: {},{} is not in an image of {}x{}; choose one from 0,0 to "
                            "{},{}, or another --size",
                            p.x, p.y, view.width, view.height, view.width - 1, view.height - 1));
}

std::vector<Ray> secondary_rays(const ImageParams& params, const Surface& surface, Pixel pixel,
                                bool faces) {
    std::vector<Ray> rays;
    if (params.rays == kRaysShadow && faces) rays.push_back(shadow_ray(surface, params.light));
    if (params.rays == kRaysAo) {
        for (std::uint32_t i = 0; i < params.ao_count; ++i) {
            rays.push_back(ao_ray(surface, pixel.x, pixel.y, i, params.ao_tfar));
        }
    }
    return rays;
}

void trace_secondary(const ImageParams& params, const Topology& topology,
                     std::span<const vec3> positions, Backend& backend, ProbeReport& report) {
    if (report.alone.prim_id == kNoPrim || params.rays == kRaysPrimary) return;
    const uvec3 corners = topology.triangles[report.alone.prim_id];
    const Surface surface = surface_at(report.ray, report.alone, positions[corners.x],
                                       positions[corners.y], positions[corners.z]);
    report.faces_light = faces_light(surface, params.light);
    const std::vector<Ray> rays = secondary_rays(params, surface, report.pixel, report.faces_light);
    std::vector<Hit> hits(rays.size());
    if (!rays.empty()) backend.trace({rays, hits});
    for (std::size_t i = 0; i < rays.size(); ++i) report.secondary.push_back({rays[i], hits[i]});
}

void report_tree(TreeUpdater& updater, ProbeReport& report) {
    report.update = name_of(updater.last().step);
    const Bvh& tree = updater.tree();
    report.tree = bvh_stats(tree);
    report.bvh_hash = bvh_hash(tree);
}

void describe_ray(const ImageParams& params, const SceneSpace& space, ProbeReport& report) {
    const Pixel p = report.pixel;
    report.exponent = space.exponent();
    report.ray = camera_ray(params.camera, p.x, p.y);
    const vec3 org = space.to_world(report.ray.org);
    report.world_org = {org.x, org.y, org.z};
    report.world_depth = space.length_to_world(camera_depth_scale(params.camera, p.x, p.y));
}

}  // namespace

ProbeReport probe_pixel(const ProbeOptions& options, const Messages& messages) {
    require_pixel(options);
    SceneFrames scene(open_clip(options.source, messages));
    const double frame_number = select_frame(options.frame, options.tree.build_at, scene.clip());
    const Topology& topology = scene.clip().topology();
    const std::unique_ptr<Backend> tracer =
        make_backend(options.backend.choice, options.backend, messages);
    messages.note("tracing on " + tracer->info().name + ": " + tracer->info().description);
    const double build_at = options.tree.build_at.value_or(frame_number);
    std::optional<Progress> progress(std::in_place, "building the tree", 0, messages);
    TreeUpdater updater(topology, scene.positions(build_at), *tracer, nullptr, options.tree.update,
                        build_config(options.tree.split, options.backend), {});
    if (build_at != frame_number) updater.update(scene.positions(frame_number));
    const ImageParams params = scene.image_params(options.view);
    Frame frame;
    progress.reset();
    progress.emplace("tracing the image", 0, messages);
    tracer->trace_image(params, frame);
    progress.reset();
    progress.emplace("testing all triangles", 0, messages);

    ProbeReport report;
    report.head = {
        "probe",      scene.clip().name(), topology.triangles.size(), topology.vertex_count,
        params.width, params.height};
    report.frame = frame_number;
    report.pixel = options.pixel;
    report.rays = name_of_rays(params.rays);
    report.backend = tracer->info().name;
    report.device = tracer->info().description;
    report_tree(updater, report);
    describe_ray(params, scene.space(), report);
    const std::size_t index = std::size_t{report.pixel.y} * params.width + report.pixel.x;
    report.image = frame.hits[index];
    report.occlusion = frame.occlusion[index];
    report.colour = frame.pixels[index];
    tracer->trace({{&report.ray, 1}, {&report.alone, 1}});
    const std::span<const vec3> positions = scene.positions(frame_number);
    trace_secondary(params, topology, positions, *tracer, report);
    const std::uint32_t wanted[] = {report.image.prim_id, report.alone.prim_id};
    report.candidates = find_candidates(report.ray, topology, positions, kCandidates, wanted);
    return report;
}

}  // namespace mray::app
