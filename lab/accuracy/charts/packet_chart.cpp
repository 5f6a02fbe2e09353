#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>

#include "cpu/packet/packet_tracer.h"
#include "cpu/single_ray/single_ray_tracer.h"
#include "lab/accuracy/charts/charts.h"
#include "lab/accuracy/measure/measure.h"

namespace mray::accuracy {
namespace {

struct Shape {
    std::uint32_t width;
    std::uint32_t height;
};
constexpr Shape kShapes[] = {{1, 1},   {2, 2},   {4, 4},   {8, 4},   {8, 8},  {16, 8},
                             {16, 16}, {32, 16}, {32, 32}, {64, 32}, {64, 64}};
// The smallest packets are slow.
constexpr std::uint32_t kMostSide = 256;

void trace_packets(const ChartScene& scene, const cpu::PacketTracer& tracer, Shape shape,
                   std::span<Hit> hits) {
    const cpu::ImageTiles tiles(scene.params.width, scene.params.height, kChartTileSide);
    tbb::parallel_for(0u, tiles.count(), [&](std::uint32_t i) {
        thread_local const auto packet = std::make_unique<cpu::CameraPacket>();
        const cpu::Tile tile = tiles[i];
        Hit* const first = &hits[std::size_t{i} * kChartTile];
        for (std::uint32_t y = tile.y0; y < tile.y1; y += shape.height) {
            for (std::uint32_t x = tile.x0; x < tile.x1; x += shape.width) {
                tracer.intersect_camera(
                    scene.params, {x, y, x + shape.width, y + shape.height}, *packet,
                    first + (y - tile.y0) * kChartTileSide + (x - tile.x0), kChartTileSide);
            }
        }
    });
}

struct Row {
    std::string target;
    std::string packet;
    /// Rays of a packet; 0: single rays.
    std::uint32_t rays;
};

}  // namespace

std::size_t packet_steps() { return 1; }

Chart packet_chart(const ChartContext& context, const ChartInput& input,
                   const std::string& suffix) {
    const ChartScene scene = make_chart_scene(input.name, input.topology, input.positions, {},
                                              std::min(context.effort.side, kMostSide), 0);
    const std::vector<SimdTarget> targets = supported_simd_targets();
    std::vector<Hit> hits(scene.scene_space.camera_rays.size());
    std::vector<std::function<void()>> runs;
    std::vector<Row> rows;
    for (const SimdTarget& target : targets) {
        Method single;
        single.in_scene_space = true;
        single.trace = [tracer = cpu::SingleRayTracer(scene.scene_space.bvh, target)](
                           std::span<const Ray> rays, std::span<Hit> out) {
            tracer.intersect(rays, out);
        };
        runs.emplace_back([&, single] { trace_camera(single, scene, hits); });
        rows.push_back({target.name, "single", 0});
        for (const Shape shape : kShapes) {
            runs.emplace_back(
                [&, shape, tracer = cpu::PacketTracer(scene.scene_space.bvh, target)] {
                    trace_packets(scene, tracer, shape, hits);
                });
            rows.push_back({target.name, fmt::format("{}x{}", shape.width, shape.height),
                            shape.width * shape.height});
        }
    }
    const std::vector<double> times = least_times(runs, context.effort.rounds, context.check);
    Table table({"target", "packet", "rays", "packets Mray/s", "single rays Mray/s"});
    std::string single;
    for (std::size_t i = 0; i < runs.size(); ++i) {
        const Row& row = rows[i];
        const std::string mrays =
            fmt::format("{:.4g}", static_cast<double>(hits.size()) / (times[i] * 1e3));
        // A target begins with its single rays, which do not depend on packets.
        if (row.rays == 0) {
            single = mrays;
        } else {
            table.add({row.target, row.packet, fmt::format("{}", row.rays), mrays, single});
        }
    }
    context.step();

    const plot::Figure figure{
        .title = fmt::format("Size of packets against speed: {}, {} triangles, camera rays",
                             input.name, input.topology.triangles.size()),
        .footer = context.footer,
        .panels = {{.kind = "lines",
                    .x = "rays",
                    .y = "\"packets Mray/s\" \"single rays Mray/s\"",
                    .series = "target",
                    .xlabel = "rays of a packet",
                    .ylabel = speed_title(),
                    .logx = "2"}}};
    return {
        "packets" + suffix,
        "Packets are faster where their line is above the level line of the same code, which is "
        "the speed of single rays over the same tree.",
        table, figure};
}

}  // namespace mray::accuracy
