// morphray_choice_bench [--isa NAME] SCENE...: whether each tile goes to the faster tracer. Times
// packets, streams of single rays and the choice between them (cpu/image/tile_tracer.h) for views
// from more and more far away and for fewer and fewer shadow rays, and rays of ambient occlusion
// as streams and one by one. Prints rows of CSV; bench/choices adds the head.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "bench/bench_scene.h"
#include "bench/interleave.h"
#include "bench/trace_work.h"
#include "common/simd/simd_target.h"
#include "cpu/image/tile_tracer.h"
#include "cpu/single_ray/single_ray_tracer.h"

namespace mray::bench {
namespace {

constexpr int kRounds = 5;
constexpr double kDistances[] = {1, 2, 4, 8};
constexpr double kShares[] = {1, 0.3, 0.1, 0.03, 0.01};

/// The default view, from so many times as far away.
BenchScene scene_from(const std::string& spec, double distance) {
    ViewSpec view;
    view.width = view.height = 1024;
    BenchScene scene = open_bench_scene(spec, ViewKind::kWhole, view);
    if (distance == 1) return scene;
    view = scene.view;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double target = (*view.target)[axis];
        (*view.eye)[axis] = target + distance * ((*view.eye)[axis] - target);
    }
    return open_bench_scene(spec, ViewKind::kGiven, view);
}

/// The tracers between which a tile's tracer is chosen, and the choice.
struct Tracers {
    cpu::TileTracer packets;
    cpu::TileTracer chosen;
    cpu::BatchTiles<cpu::SingleRayTracer> streams;

    Tracers(const Bvh& bvh, const SimdTarget& target)
        : packets(bvh, target, cpu::PacketUse::kAlways),
          chosen(bvh, target),
          streams(cpu::SingleRayTracer(bvh, target)) {}
};

/// Prints a row: nanoseconds a ray of each method, the last of which is the choice, and its time
/// over that of the best of the others.
void print_row(const BenchScene& scene, double distance, const char* work, double share,
               std::size_t rays, std::span<const Times> times) {
    const auto of_ray = [&](std::size_t k) {
        return times[k].least_ms * 1e6 / static_cast<double>(rays);
    };
    fmt::print("{},{:g},{},{:g},{},{:.2f},{:.2f},{:.2f},{:.3f}\n", scene.name, distance, work,
               share, rays, of_ray(0), of_ray(1), of_ray(2),
               times[2].least_ms / std::min(times[0].least_ms, times[1].least_ms));
    std::fflush(stdout);
}

std::size_t first_pixel(const TraceWork& work, const TileRays& square) {
    return std::size_t{square.tile.y0} * work.params.width + square.tile.x0;
}

/// Hits of camera rays, and how many leaves the chosen tracer's packets visited in each square.
struct CameraAnswers {
    AlignedVector<Hit> hits;
    std::vector<std::uint32_t> leaves;
};

CameraAnswers bench_primary(const BenchScene& scene, double distance, const Tracers& tracers,
                            const TraceWork& work) {
    CameraAnswers answers{AlignedVector<Hit>(work.rays.size()),
                          std::vector<std::uint32_t>(work.squares.size())};
    const std::uint32_t width = work.params.width;
    const auto packets = [&](const cpu::TileTracer& tracer) {
        return [&](std::size_t i) {
            const TileRays& square = work.squares[i];
            answers.leaves[i] = tracer.intersect_camera(
                work.params, square.tile, &answers.hits[first_pixel(work, square)], width);
        };
    };
    const auto stream = [&](std::size_t i) {
        const TileRays& square = work.squares[i];
        tracers.chosen.intersect_streams(work.params, square.tile,
                                         &answers.hits[first_pixel(work, square)], width);
    };
    const PartMethod methods[] = {{"packet", {}, packets(tracers.packets)},
                                  {"stream", {}, stream},
                                  {"chosen", {}, packets(tracers.chosen)}};
    print_row(scene, distance, "primary", 1, work.rays.size(),
              time_parts(methods, work.squares.size(), kRounds));
    for (std::size_t i = 0; i < work.squares.size(); ++i) packets(tracers.chosen)(i);
    to_ray_order(work, answers.hits);
    return answers;
}

/// Keeps a share of the active rays, evenly spread.
void keep_share(TraceWork& work, double share) {
    work.active_count = 0;
    for (std::size_t i = 0; i < work.rays.size(); ++i) {
        const std::uint32_t place = static_cast<std::uint32_t>(i) * 0x9E3779B1u;
        if (work.active[i] != 0 && place >= share * 0x1p32) {
            work.active[i] = 0;
            work.shadows[i / kPacketSize].tfar[i % kPacketSize] = -1;
        }
        work.active_count += work.active[i];
    }
}

void bench_shadows(const BenchScene& scene, double distance, double share, const Tracers& tracers,
                   const TraceWork& primary, const CameraAnswers& camera, TraceWork work) {
    keep_share(work, share);
    std::vector<cpu::TileCounts> counts;
    std::vector<const TileRays*> squares;
    for (const TileRays& square : work.squares) {
        const auto active = std::span(work.active).subspan(square.begin, square.end - square.begin);
        const auto rays = static_cast<std::size_t>(std::ranges::count(active, 1));
        if (rays == 0) continue;  // an image does not trace them
        squares.push_back(&square);
        const auto same = std::ranges::find_if(primary.squares, [&](const TileRays& other) {
            return other.tile.x0 == square.tile.x0 && other.tile.y0 == square.tile.y0;
        });
        counts.push_back(
            {rays, camera.leaves[static_cast<std::size_t>(same - primary.squares.begin())]});
    }
    if (squares.empty()) return;
    std::vector<std::uint8_t> occluded(kSquareSize * kSquareSize);
    const auto by = [&](const auto& tracer, auto... more) {
        return [&, more...](std::size_t i) {
            const TileRays& square = *squares[i];
            tracer.occluded_shared_origin(work.params.light, shadows_of(work, square),
                                          std::span(occluded).first(square.end - square.begin),
                                          more[i]...);
        };
    };
    const PartMethod methods[] = {{"packet", {}, by(tracers.packets)},
                                  {"stream", {}, by(tracers.streams)},
                                  {"chosen", {}, by(tracers.chosen, counts)}};
    print_row(scene, distance, "shadow", share, work.active_count,
              time_parts(methods, squares.size(), kRounds));
}

void bench_ao(const BenchScene& scene, double distance, const Tracers& tracers,
              const TraceWork& work) {
    std::vector<std::uint8_t> occluded(work.rays.size());
    const auto traced = [&](std::size_t most) {
        return [&, most](std::size_t i) {
            for_each_active_run(work, work.squares[i], [&](std::size_t begin, std::size_t end) {
                for (std::size_t count = 0; begin < end; begin += count) {
                    count = std::min(most, end - begin);
                    tracers.streams.occluded(std::span(work.rays).subspan(begin, count),
                                             std::span(occluded).subspan(begin, count));
                }
            });
        };
    };
    const PartMethod methods[] = {{"single", {}, traced(1)},
                                  {"stream", {}, traced(work.rays.size())},
                                  {"chosen", {}, traced(work.rays.size())}};
    print_row(scene, distance, "ao", 1, work.active_count,
              time_parts(methods, work.squares.size(), kRounds));
}

void bench_choices(const std::string& spec, const SimdTarget& target) {
    for (const double distance : kDistances) {
        const BenchScene scene = scene_from(spec, distance);
        const Tracers tracers(scene.bvh, target);
        const TraceWork primary = make_primary_work(scene.params);
        const CameraAnswers camera = bench_primary(scene, distance, tracers, primary);
        const TraceWork shadow =
            make_secondary_work(primary, camera.hits, scene.mesh(), WorkKind::kShadow);
        for (const double share : kShares)
            bench_shadows(scene, distance, share, tracers, primary, camera, shadow);
        bench_ao(scene, distance, tracers,
                 make_secondary_work(primary, camera.hits, scene.mesh(), WorkKind::kAo, 4,
                                     primary.rays.size()));
    }
}

}  // namespace
}  // namespace mray::bench

int main(int argc, char** argv) {
    using namespace mray;
    SimdTarget target = find_simd_target("best");
    int first = 1;
    if (argc > 2 && std::strcmp(argv[1], "--isa") == 0) {
        target = find_simd_target(argv[2]);
        first = 3;
    }
    for (int i = first; i < argc; ++i) bench::bench_choices(argv[i], target);
}
