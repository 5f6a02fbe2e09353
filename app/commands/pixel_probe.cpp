#include "app/commands/pixel_probe.h"
#include "app/clip/frames.h"

#include <fmt/format.h>

#include <optional>
#include <utility>
#include <vector>

#include "app/backends/backends.h"
#include "app/commands/candidates.h"
#include "app/terminal/progress.h"
#include "common/base/errors.h"
#include "common/interop/camera.h"
#include "common/interop/surface.h"
#include "common/update/tree_updater.h"

namespace mray::app {
namespace {

constexpr std::size_t kCandidates = 8;

void require_pixel(const Options& options) {
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
    if (!rays.empty()) backend.trace_rays(rays, hits);
    for (std::size_t i = 0; i < rays.size(); ++i) report.secondary.push_back({rays[i], hits[i]});
}

/// The backend that refitted the tree of this frame, "cpu" or "vulkan"; empty after a build.
std::string refitted_on(const TreeUpdate& update, const Backend& refitter) {
    if (update.step == TreeStep::kBuilt || update.step == TreeStep::kRebuilt) return {};
    const std::string& name = refitter.info().name;
    return name == "brute" ? "cpu" : name;
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

ProbeReport probe_pixel(const Options& options, const Messages& messages) {
    require_pixel(options);
    SceneFrames scene = open_frames(options, messages);
    const double frame_number = select_frame(options, scene.clip());
    const Topology& topology = scene.clip().topology();
    const std::unique_ptr<Backend> tracer = make_backend(options.backend, messages);
    const std::unique_ptr<Backend> refitter = make_refitter(options, *tracer, messages);
    messages.note("tracing on " + tracer->info().name + ": " + tracer->info().description);
    const double build_at = options.tree.build_at.value_or(frame_number);
    std::optional<Progress> progress(std::in_place, "building the tree", "", 0,
                                     progress_mode(options));
    TreeUpdater updater(topology, scene.positions(build_at), *tracer, refitter.get(),
                        options.tree.policy(), build_config(options), options.tree.update_config);
    if (build_at != frame_number) updater.update(scene.positions(frame_number));
    const ImageParams params = image_params(options, scene);
    Frame frame;
    progress.reset();
    progress.emplace("tracing the image", "", 0, progress_mode(options));
    tracer->trace_image(params, frame);
    progress.reset();
    progress.emplace("testing all triangles", "", 0, progress_mode(options));

    ProbeReport report;
    report.head = {
        "probe",      scene.clip().name(), topology.triangles.size(), topology.vertex_count,
        params.width, params.height};
    report.frame = frame_number;
    report.pixel = options.pixel;
    report.rays = name_of_rays(params.rays);
    report.backend = tracer->info().name;
    report.device = tracer->info().description;
    report.refit_on = refitted_on(updater.last(), refitter ? *refitter : *tracer);
    report_tree(updater, report);
    describe_ray(params, scene.space(), report);
    const std::size_t index = std::size_t{report.pixel.y} * params.width + report.pixel.x;
    report.image = frame.hits[index];
    report.occlusion = frame.occlusion[index];
    report.colour = frame.pixels[index];
    tracer->trace_rays({&report.ray, 1}, {&report.alone, 1});
    const std::span<const vec3> positions = scene.positions(frame_number);
    trace_secondary(params, topology, positions, *tracer, report);
    const std::uint32_t wanted[] = {report.image.prim_id, report.alone.prim_id};
    report.candidates = find_candidates(report.ray, topology, positions, kCandidates, wanted);
    return report;
}

}  // namespace mray::app
