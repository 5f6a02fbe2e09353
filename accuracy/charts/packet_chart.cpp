#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>

#include "accuracy/charts/charts.h"
#include "accuracy/measure/measure.h"
#include "cpu/packet/packet_tracer.h"
#include "cpu/single_ray/single_ray_tracer.h"

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

}  // namespace

std::size_t packet_steps() { return 1; }

Chart packet_chart(const ChartContext& context, const ChartInput& input,
                   const std::string& suffix) {
    const ChartScene scene = make_chart_scene(input.name, input.topology, input.positions, {},
                                              std::min(context.effort.side, kMostSide), 0);
    const std::vector<SimdTarget> targets = supported_simd_targets();
    std::vector<Hit> hits(scene.scene_space.camera_rays.size());
    std::vector<std::function<void()>> runs;
    std::vector<std::array<std::string, 3>> names;  // target, shape, rays
    for (const SimdTarget& target : targets) {
        Method single;
        single.in_scene_space = true;
        single.trace = [tracer = cpu::SingleRayTracer(scene.scene_space.bvh, target)](
                           std::span<const Ray> rays, std::span<Hit> out) {
            tracer.intersect(rays, out);
        };
        runs.emplace_back([&, single] { trace_camera(single, scene, hits); });
        names.push_back({target.name, "single", "0"});
        for (const Shape shape : kShapes) {
            runs.emplace_back(
                [&, shape, tracer = cpu::PacketTracer(scene.scene_space.bvh, target)] {
                    trace_packets(scene, tracer, shape, hits);
                });
            names.push_back({target.name, fmt::format("{}x{}", shape.width, shape.height),
                             fmt::format("{}", shape.width * shape.height)});
        }
    }
    const std::vector<double> times = least_times(runs, context.effort.rounds, context.check);
    Table table({"target", "packet", "rays", "Mray/s"});
    for (std::size_t i = 0; i < runs.size(); ++i) {
        table.add({names[i][0], names[i][1], names[i][2],
                   fmt::format("{:.4g}", static_cast<double>(hits.size()) / (times[i] * 1e3))});
    }
    context.step();

    const std::string name = "packets" + suffix;
    PlotScript script;
    script.title = fmt::format("Size of packets against speed: {}, {} triangles, camera rays",
                               input.name, input.topology.triangles.size());
    script.footer = context.footer;
    script.body =
        "set logscale x 2\nset logscale y\nset xrange [0.8:1300]\nset key bottom right noenhanced\n"
        "set xlabel 'rays of a packet'\nset ylabel 'Mray/s'\nset xtics 2\nplot ";
    for (std::size_t i = 0; i < targets.size(); ++i) {
        script.body += fmt::format(
            "{0}'{1}.csv' skip 1 using (strcol(1) eq '{2}' && $3 > 0 ? $3 : NaN):4 with "
            "linespoints pt 7 lw 2 lc {3} title '{2}, packets', "
            "'{1}.csv' skip 1 using (strcol(1) eq '{2}' && $3 == 0 ? 1 : NaN):4:(1023):(0) with "
            "vectors nohead dt 2 lw 2 lc {3} title '{2}, single rays'",
            i == 0 ? "" : ", ", name, targets[i].name, i + 1);
    }
    script.body += "\n";
    return {name,
            "Packets are faster where a line is above the dashed line of its colour, which is the "
            "speed of single rays over the same tree.",
            table, script};
}

}  // namespace mray::accuracy
