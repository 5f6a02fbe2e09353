#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "common/base/stopwatch.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/bvh/bvh_stats.h"
#include "common/interop/camera.h"
#include "cpu/packet/packet_tracer.h"
#include "cpu/refit/refit.h"
#include "cpu/single_ray/single_ray_tracer.h"
#include "lab/accuracy/charts/charts.h"
#include "lab/accuracy/measure/measure.h"
#include "lab/accuracy/methods/median_tree.h"

namespace mray::accuracy {
namespace {

constexpr std::uint32_t kSide = cpu::kCameraSide;
// Degraded trees are slow.
constexpr std::uint32_t kMostSide = 256;

struct Tree {
    std::string name;
    double build_ms;
    Bvh bvh;
};

template <class Build>
Tree timed(const char* name, Build build) {
    const Stopwatch watch;
    Bvh bvh = build();
    return {name, watch.ms(), std::move(bvh)};
}

/// A tree that was built some frames earlier, within the clip, and refitted to `frame`.
Tree refitted(SceneFrames& scene, double frame, double age) {
    const double from = std::max(scene.clip().first_frame(), frame - age);
    const Topology& topology = scene.clip().topology();
    Bvh bvh = build_bvh(topology, scene.positions(from));
    const Stopwatch watch;
    cpu::refit(bvh, scene.positions(frame));
    return {fmt::format("refitted after {:g} frame{}", frame - from, frame - from == 1 ? "" : "s"),
            watch.ms(), std::move(bvh)};
}

std::vector<Tree> make_trees(SceneFrames& scene, double frame) {
    const Topology& topology = scene.clip().topology();
    const std::span<const vec3> positions = scene.positions(frame);
    std::vector<Tree> trees;
    trees.push_back(timed("binned (ours)", [&] { return build_bvh(topology, positions); }));
    trees.push_back(timed(
        "sweep", [&] { return build_bvh(topology, positions, {.split = SplitMethod::kSweep}); }));
    trees.push_back(timed("median", [&] { return build_median_tree(topology, positions); }));
    if (frame == scene.clip().first_frame()) return trees;
    for (const double age : {1.0, 4.0, 1e9}) trees.push_back(refitted(scene, frame, age));
    return trees;
}

/// Calls visit(tile of pixels, index of its first hit) for all tiles, on all threads.
template <class Visit>
void for_each_tile(const ImageParams& params, Visit visit) {
    const cpu::ImageTiles tiles(params.width, params.height, kSide);
    tbb::parallel_for(0u, tiles.count(),
                      [&](std::uint32_t i) { visit(tiles[i], std::size_t{i} * kSide * kSide); });
}

void trace_packets(const Bvh& bvh, const ImageParams& params, std::span<Hit> hits) {
    const cpu::PacketTracer tracer(bvh, supported_simd_targets().front());
    for_each_tile(params, [&](const cpu::Tile& tile, std::size_t first) {
        thread_local const auto packet = std::make_unique<cpu::CameraPacket>();
        tracer.intersect_camera(params, tile, *packet, &hits[first], kSide);
    });
}

void trace_singly(const Bvh& bvh, const ImageParams& params, std::span<Hit> hits) {
    const cpu::SingleRayTracer tracer(bvh, supported_simd_targets().front());
    for_each_tile(params, [&](const cpu::Tile& tile, std::size_t first) {
        std::vector<Ray> rays;
        for (std::uint32_t y = tile.y0; y < tile.y1; ++y) {
            for (std::uint32_t x = tile.x0; x < tile.x1; ++x)
                rays.push_back(camera_ray(params.camera, x, y));
        }
        tracer.intersect(rays, hits.subspan(first, rays.size()));
    });
}

bool same(const Hit& a, const Hit& b) {
    return a.prim_id == b.prim_id && a.t == b.t && a.u == b.u && a.v == b.v;
}

}  // namespace

std::size_t tree_steps() { return 2; }

Chart tree_chart(const ChartContext& context, SceneFrames& scene, const std::string& suffix) {
    const Clip& clip = scene.clip();
    const double frame = std::floor((clip.first_frame() + clip.last_frame()) / 2);
    const std::vector<Tree> trees = make_trees(scene, frame);
    context.step();
    ViewSpec view;
    view.width = view.height = std::clamp(context.effort.side / 2, kSide, kMostSide);
    view.fov = kChartFov;
    const ImageParams params = scene.image_params(view);
    const std::size_t pixels = std::size_t{params.width} * params.height;
    std::vector<std::vector<Hit>> hits(2 * trees.size(), std::vector<Hit>(pixels));
    std::vector<std::function<void()>> runs;
    for (std::size_t i = 0; i < trees.size(); ++i) {
        runs.emplace_back([&, i] { trace_packets(trees[i].bvh, params, hits[2 * i]); });
        runs.emplace_back([&, i] { trace_singly(trees[i].bvh, params, hits[2 * i + 1]); });
    }
    const std::vector<double> times = least_times(runs, context.effort.rounds, context.check);
    Table table({"tree", "row", "packets Mray/s", "single Mray/s", "SAH cost", "make ms", "MiB",
                 "different answers"});
    for (std::size_t i = 0; i < trees.size(); ++i) {
        std::size_t different = 0;
        for (std::size_t p = 0; p < pixels; ++p) {
            different += !same(hits[2 * i][p], hits[0][p]);
            different += !same(hits[2 * i + 1][p], hits[0][p]);
        }
        const auto mrays = [&](std::size_t run) {
            return static_cast<double>(pixels) / (times[run] * 1e3);
        };
        const BvhStats stats = bvh_stats(trees[i].bvh);
        table.add({trees[i].name, fmt::format("{}", i), fmt::format("{:.4g}", mrays(2 * i)),
                   fmt::format("{:.4g}", mrays(2 * i + 1)), fmt::format("{:.2f}", stats.sah_cost),
                   fmt::format("{:.2f}", trees[i].build_ms),
                   fmt::format("{:.2f}", static_cast<double>(stats.bytes) / 0x1p20),
                   fmt::format("{}", different)});
    }
    context.step();

    const plot::Figure figure{.title = fmt::format("Kinds of trees: {}, {} triangles", clip.name(),
                                                   clip.topology().triangles.size()),
                              .footer = context.footer,
                              .panel_height = 380,
                              .panels = {{.kind = "bars",
                                          .y = "\"packets Mray/s\" \"single Mray/s\"",
                                          .series = "tree",
                                          .xlabel = speed_title()}}};
    return {"trees" + suffix,
            "The same rays over different trees. Answers do not depend on the tree: none differs "
            "from that over the first tree.",
            table, figure};
}

}  // namespace mray::accuracy
