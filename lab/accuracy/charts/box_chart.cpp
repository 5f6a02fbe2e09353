#include <fmt/format.h>

#include <algorithm>

#include "lab/accuracy/charts/charts.h"
#include "lab/accuracy/measure.h"

namespace mray::accuracy {
namespace {

constexpr std::uint32_t kMostSide = 512;

}  // namespace

std::size_t box_steps() { return 2; }

Chart box_chart(const ChartContext& context, const ChartInput& input, const std::string& suffix) {
    const ChartScene scene = make_chart_scene(input, {}, std::min(context.effort.side, kMostSide),
                                              context.effort.placed_rays);
    const Judge judge(scene, scene.scene_space);
    const std::vector<Method> methods = box_methods(scene);
    std::vector<Hit> hits(scene.scene_space.camera_rays.size());
    std::vector<Hit> aimed(scene.scene_space.aimed_rays.size());
    context.step();
    std::vector<std::function<void()>> runs;
    for (const Method& method : methods)
        runs.emplace_back([&] { trace_camera(method, scene, hits); });
    const std::vector<double> times = least_times(runs, context.effort.rounds, context.check);
    Table table({"method", "row", "Mray/s", "camera wrong", "aimed wrong", "leaks", "false misses",
                 "wrong triangles", "not as over ours"});
    std::vector<Hit> ours;
    for (std::size_t i = 0; i < methods.size(); ++i) {
        trace_camera(methods[i], scene, hits);
        trace_aimed(methods[i], scene, aimed);
        std::vector<Hit> all = hits;
        all.insert(all.end(), aimed.begin(), aimed.end());
        if (i == 0) ours = all;
        std::size_t different = 0;
        for (std::size_t ray = 0; ray < all.size(); ++ray) {
            const Hit& a = all[ray];
            const Hit& b = ours[ray];
            different += a.prim_id != b.prim_id || a.t != b.t || a.u != b.u || a.v != b.v;
        }
        const VerdictCounts seen = judge.camera(hits);
        const VerdictCounts met = judge.aimed(aimed);
        const auto both = [&](Verdict verdict) { return std::to_string((seen + met)[verdict]); };
        table.add({methods[i].name, fmt::format("{}", i),
                   fmt::format("{:.4g}", static_cast<double>(hits.size()) / (times[i] * 1e3)),
                   fmt::format("{}", seen.wrong()), fmt::format("{}", met.wrong()),
                   both(Verdict::kLeak), both(Verdict::kFalseMiss), both(Verdict::kWrongTriangle),
                   fmt::format("{}", different)});
    }
    context.step();

    const plot::Figure figure{
        .title =
            fmt::format("Box tests: {}, {} triangles", input.name, input.topology.triangles.size()),
        .footer = context.footer,
        .panel_height = 320,
        .panels = {{.kind = "bars",
                    .y = "\"Mray/s\"",
                    .series = "method",
                    .xlabel = speed_title("camera rays by one scalar traversal")}}};
    return {"boxes" + suffix, table, figure};
}

}  // namespace mray::accuracy
