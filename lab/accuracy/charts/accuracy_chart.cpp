#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>

#include "lab/accuracy/charts/charts.h"
#include "lab/accuracy/measure.h"

namespace mray::accuracy {
namespace {

struct Point {
    std::string name;
    double mrays = 0;
    VerdictCounts camera;
    VerdictCounts aimed;
};

/// Whether no other method is at least as fast and as accurate, and better in one of the two.
bool on_front(const Point& point, const std::vector<Point>& all, VerdictCounts Point::*counts) {
    const double wrong = (point.*counts).wrong_per_million();
    for (const Point& other : all) {
        const double theirs = (other.*counts).wrong_per_million();
        if (theirs <= wrong && other.mrays >= point.mrays &&
            (theirs < wrong || other.mrays > point.mrays)) {
            return false;
        }
    }
    return true;
}

Table table_of(const std::vector<Point>& points) {
    std::vector<std::string> header = {
        "method",       "Mray/s",     "camera rays", "camera wrong",  "camera wrong/M",
        "camera front", "aimed rays", "aimed wrong", "aimed wrong/M", "aimed front"};
    header.insert(header.end(), kVerdictColumns.begin(), kVerdictColumns.end());
    header.emplace_back("worst ulps");
    Table table(header);
    const auto yes = [](bool value) { return value ? "yes" : "no"; };
    for (const Point& p : points) {
        std::vector<std::string> row = {p.name,
                                        fmt::format("{:.4g}", p.mrays),
                                        fmt::format("{}", p.camera.rays),
                                        fmt::format("{}", p.camera.wrong()),
                                        fmt::format("{:.4g}", p.camera.wrong_per_million()),
                                        yes(on_front(p, points, &Point::camera)),
                                        fmt::format("{}", p.aimed.rays),
                                        fmt::format("{}", p.aimed.wrong()),
                                        fmt::format("{:.4g}", p.aimed.wrong_per_million()),
                                        yes(on_front(p, points, &Point::aimed))};
        const VerdictCounts both = p.camera + p.aimed;
        for (const std::string& cell : verdict_cells(both)) row.push_back(cell);
        row.push_back(fmt::format("{:.3g}", both.worst_ulps));
        table.add(row);
    }
    return table;
}

/// "Mray/s, camera rays on 2 threads"
std::string speed_title() {
    const int threads = tbb::this_task_arena::max_concurrency();
    return fmt::format("Mray/s, camera rays on {} thread{}", threads, threads == 1 ? "" : "s");
}

/// One panel of the rays that columns call `rays`.
plot::Panel panel_of(const std::string& title, const std::string& rays, std::uint64_t count) {
    const double one = 1e6 / static_cast<double>(std::max<std::uint64_t>(1, count));
    return {.kind = "points",
            .title = title,
            .x = rays + " wrong/M",
            .y = "Mray/s",
            .series = "method",
            .xlabel = fmt::format("wrong answers per million rays (one ray: {:.2g})", one),
            .ylabel = speed_title(),
            .ring = rays + " front",
            .logx = "10"};
}

}  // namespace

Chart accuracy_chart(const ChartContext& context, const ChartInput& input,
                     const std::string& suffix) {
    const Effort& effort = context.effort;
    const ChartScene scene = make_chart_scene(input, effort.side, effort.aimed_rays);
    const std::vector<Method> methods = all_methods(scene, context.make_vulkan_backend);
    const Judge in_scene_space(scene, scene.scene_space);
    const Judge in_world_space(scene, scene.world_space);
    std::vector<Point> points;
    const std::size_t pixels = scene.scene_space.camera_rays.size();
    std::vector<Hit> hits(pixels);
    std::vector<Hit> aimed(scene.scene_space.aimed_rays.size());
    std::vector<std::function<void()>> runs;
    for (const Method& method : methods) {
        const Judge& judge = method.in_scene_space ? in_scene_space : in_world_space;
        Point& point = points.emplace_back();
        point.name = method.name;
        trace_camera(method, scene, hits);
        point.camera = judge.camera(hits);
        trace_aimed(method, scene, aimed);
        point.aimed = judge.aimed(aimed);
        runs.emplace_back([&] { trace_camera(method, scene, hits); });
    }
    const std::vector<double> times = least_times(runs, effort.rounds);
    for (std::size_t i = 0; i < points.size(); ++i)
        points[i].mrays = static_cast<double>(pixels) / (times[i] * 1e3);

    const plot::Figure figure{
        .title = fmt::format("Speed against accuracy: {}, {} triangles", input.name,
                             input.topology.triangles.size()),
        .footer = context.footer,
        .columns = 2,
        .panel_height = 560,
        .panels = {panel_of(fmt::format("{} pixels of a camera", pixels), "camera", pixels),
                   panel_of(fmt::format("{} rays at vertices, edges, faces", aimed.size()), "aimed",
                            aimed.size())}};
    return {"accuracy" + suffix, table_of(points), figure};
}

}  // namespace mray::accuracy
