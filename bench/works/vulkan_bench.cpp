#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "bench/embree/embree_pixels.h"
#include "bench/embree/embree_tracer.h"
#include "bench/works/ours.h"
#include "bench/works/works.h"
#include "common/base/errors.h"
#include "common/base/thread_arena.h"
#include "gpu/vulkan_backend.h"

namespace mray::bench {
namespace {

/// The times of a method's runs by the clock of the device; the first run warms up.
struct DeviceClock {
    Samples samples;

    void add(double ms) { samples.push_back(ms); }
    Samples without_warm_up() const { return {samples.begin() + 1, samples.end()}; }
};

/// Pixels are the rays of `primary`, and as many of a shadow work.
TraceAnswers answers_of(const TraceWork& work, const Frame& frame) {
    TraceAnswers answers(work);
    std::size_t i = 0;
    for (const TileRays& rays : work.tiles) {
        for_each_pixel(rays.tile, [&](std::uint32_t x, std::uint32_t y) {
            const std::size_t pixel = std::size_t{y} * work.params.width + x;
            if (work.any_hit()) {
                answers.occluded[i] = frame.occlusion[pixel] != 0;
            } else {
                answers.hits[i] = frame.hits[pixel];
            }
            ++i;
        });
    }
    return answers;
}

/// Differences in the number of occluded ambient-occlusion rays of each pixel; an image holds no
/// more than that.
Mismatches compare_occlusion(const TraceWork& work, const Frame& frame,
                             const TraceAnswers& answers) {
    Mismatches mismatches;
    for (const TileRays& rays : work.tiles) {
        std::size_t i = rays.begin;
        for_each_pixel(rays.tile, [&](std::uint32_t x, std::uint32_t y) {
            const std::size_t pixel = std::size_t{y} * work.params.width + x;
            if (frame.hits[pixel].prim_id == kNoPrim) return;
            std::uint32_t occluded = 0;
            for (std::uint32_t k = 0; k < work.params.ao_count; ++k, ++i) {
                occluded += answers.occluded[i];
            }
            const std::uint32_t mine = frame.occlusion[pixel];
            mismatches.hit += std::max(mine, occluded) - std::min(mine, occluded);
        });
    }
    return mismatches;
}

Mismatches compare_frame(const TraceWork& work, const Frame& frame, const TraceAnswers& answers) {
    if (work.kind == WorkKind::kAo) return compare_occlusion(work, frame, answers);
    return compare_answers(work, answers_of(work, frame), answers);
}

Mismatches compare_frames(const TraceWork& work, const Frame& a, const Frame& b) {
    if (work.kind != WorkKind::kAo) {
        return compare_answers(work, answers_of(work, a), answers_of(work, b));
    }
    Mismatches mismatches;
    for (std::size_t i = 0; i < a.occlusion.size(); ++i) {
        mismatches.hit +=
            std::max(a.occlusion[i], b.occlusion[i]) - std::min(a.occlusion[i], b.occlusion[i]);
    }
    return mismatches;
}

void bench_rays(const Rig& rig, const BenchScene& scene, Backend& vulkan, const TraceWork& work) {
    ThreadArena arena(rig.threads);
    const SimdTarget scalar[] = {find_simd_target("scalar")};
    const std::vector<OurTracer> tracers = our_tracers(scene.bvh, scalar);
    const OurTracer& reference = tracers.back();
    TraceAnswers reference_answers(work);
    const EmbreeMesh mesh(scene.topology(), scene.positions);
    const EmbreeScene medium(rig.devices.front(), mesh, EmbreeTree::kMedium);
    const std::unique_ptr<EmbreeTracer> embree = single_rays_from_memory(work);

    Frame frame;
    vulkan.trace_image(work.params, frame);
    // For Embree with rays that are made from hits within the time, as the device's rays are.
    Frame pixels = frame;
    const cpu::PixelShader shader(best_simd_target());
    DeviceClock clock;
    std::vector<Method> methods = {
        {"vulkan",
         {},
         [&] {
             vulkan.trace_image(work.params, frame);
             const BackendTimes& t = vulkan.finish();
             clock.add(work.any_hit() ? t.secondary_ms : t.trace_ms - t.secondary_ms - t.shade_ms);
         }},
        {"cpu-scalar",
         {},
         [&] { arena.execute([&] { reference.trace(work, reference_answers); }); }},
        {work.any_hit() ? "embree-occluded1" : "embree-intersect1",
         [&] { arena.execute([&] { embree->reset(); }); },
         [&] { arena.execute([&] { embree->trace(medium, work.whole()); }); }}};
    if (work.any_hit()) {
        methods.push_back(
            {"embree-occluded1-pixels", {}, [&] {
                 arena.execute([&] { trace_pixels(medium, work, scene.mesh(), shader, pixels); });
             }});
    }
    const std::vector<Samples> samples = time_interleaved(methods, rig.repeat);

    if (reference.in_image_order && !work.any_hit()) {
        to_ray_order(work, reference_answers.hits);
    }
    const TraceAnswers theirs = embree->answers();
    const auto report = [&](const std::string& peer, const Mismatches& mismatches,
                            const Samples& peer_samples) {
        Row row = row_of(rig, scene, work, theirs);
        row.tracer = "single rays";
        row.target = "vulkan";
        row.peer = peer;
        row.mismatches = mismatches;
        set_times(row, times_of(clock.without_warm_up()), times_of(peer_samples),
                  Unit::kMrayPerSecond, work.active_count);
        rig.report(row);
    };
    for (std::size_t peer = 1; peer < methods.size(); ++peer) {
        const Mismatches mismatches = peer == 1   ? compare_frame(work, frame, reference_answers)
                                      : peer == 2 ? compare_frame(work, frame, theirs)
                                                  : compare_frames(work, frame, pixels);
        report(methods[peer].name, mismatches, samples[peer]);
    }
}

/// Refit against update(positions) of a peer for the same frames, both with the upload, in wall
/// time.
template <class Update>
void bench_refit_beside(const Rig& rig, const BenchScene& scene, Backend& vulkan, const char* peer,
                        Update update) {
    std::size_t round = 0;
    const auto frame = [&] { return std::span(round % 2 == 0 ? scene.moved : scene.positions); };
    const Method methods[] = {{"vulkan",
                               {},
                               [&] {
                                   vulkan.refit(frame());
                                   vulkan.finish();
                               }},
                              {peer, {}, [&] { update(frame()), ++round; }}};
    const std::vector<Samples> samples = time_interleaved(methods, rig.repeat);
    Row row = row_of(rig, scene, "refit");
    row.tracer = "levels";
    row.target = "vulkan";
    row.peer = methods[1].name;
    set_times(row, times_of(samples[0]), times_of(samples[1]), Unit::kNsPerTriangle, row.triangles);
    rig.report(row);
}

void bench_device_refit(const Rig& rig, const BenchScene& scene, Backend& vulkan) {
    ThreadArena one_thread(1);
    const OurRefit refit = our_refits().front();
    Bvh bvh = scene.bvh;
    bench_refit_beside(rig, scene, vulkan, "cpu-refit-1t", [&](std::span<const vec3> positions) {
        one_thread.execute([&] { refit.refit(bvh, positions); });
    });
}

}  // namespace

void bench_vulkan(const Rig& rig, const BenchScene& scene,
                  std::span<const TraceWork* const> works) {
    const std::unique_ptr<Backend> vulkan = gpu::make_vulkan_backend();
    vulkan->set_scene(scene.topology(), scene.positions, scene.bvh);
    for (const TraceWork* work : works) bench_rays(rig, scene, *vulkan, *work);
    bench_device_refit(rig, scene, *vulkan);
}

}  // namespace mray::bench
