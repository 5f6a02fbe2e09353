#include "app/commands/pixel_probe.h"
#include "app/frames.h"

#include <fmt/format.h>

#include <vector>

#include "app/backends.h"
#include "app/commands/probe/replay.h"
#include "app/files/ray_bundle.h"
#include "app/memory_budget.h"
#include "common/base/errors.h"
#include "common/interop/camera.h"
#include "common/interop/surface.h"

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

void describe_session(Session& session, ProbeReport& report) {
    report.backend = session.tracer().name();
    report.device = session.tracer().description();
    report.update = name_of(session.last_update().step);
    report.refit_on = session.refitted_on();
    const Bvh& tree = session.tree();
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
    const std::uint64_t pixels = std::uint64_t{options.view.width} * options.view.height;
    require_memory({.triangles = topology.triangles.size(),
                    .vertices = topology.vertex_count,
                    .copies = options.tree.refit_on == RefitOn::kOwn ? 0u : 1u,
                    .pixels = pixels,
                    .devices = named_devices(options)},
                   options.scene);
    const ImageParams params = image_params(options, scene);
    Session session = open_session(options, scene, frame_number, messages);
    session.advance(frame_number);
    Frame frame;
    session.trace(params, frame);

    ProbeReport report;
    report.head = {
        "probe",      scene.clip().name(), topology.triangles.size(), topology.vertex_count,
        params.width, params.height};
    report.frame = frame_number;
    report.pixel = options.pixel;
    report.rays = name_of_rays(params.rays);
    describe_session(session, report);
    describe_ray(params, scene.space(), report);
    const std::size_t index = std::size_t{report.pixel.y} * params.width + report.pixel.x;
    report.image = frame.hits[index];
    report.occlusion = frame.occlusion[index];
    report.colour = frame.pixels[index];
    session.tracer().trace_rays({&report.ray, 1}, {&report.alone, 1});
    const std::span<const vec3> positions = scene.positions(frame_number);
    trace_secondary(params, topology, positions, session.tracer(), report);
    const std::uint32_t wanted[] = {report.image.prim_id, report.alone.prim_id};
    report.candidates = find_candidates(report.ray, topology, positions, kCandidates, wanted);
    if (!options.bundle.empty())
        write_report(options.bundle, bundle_text(make_bundle(report, params, topology, positions)));
    return report;
}

}  // namespace mray::app
