#include <fmt/format.h>

#include <algorithm>
#include <ctime>

#include "common/report/guarded_run.h"
#include "lab/accuracy/charts/charts.h"
#include "lab/accuracy/measure/measure.h"

namespace mray::accuracy {
namespace {

// Divides the effort's pixels a side.
constexpr std::uint32_t kLessSide = 8;
// Some thousand times the time that a cell takes.
constexpr unsigned kLimitS = 60;

/// Milliseconds for which the calling thread has run. std::clock() advances in ticks of some
/// milliseconds while the process has a limit of processor time.
double thread_ms() {
    std::timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

struct Cell {
    std::size_t row = 0;
    std::size_t column = 0;
    std::string scene;
    std::string method;
    VerdictCounts camera;
    VerdictCounts aimed;
    RunEnd end = RunEnd::kDone;
    double mrays = 0;

    std::uint64_t rays() const { return camera.rays + aimed.rays; }
    std::uint64_t wrong() const { return camera.wrong() + aimed.wrong(); }
    std::uint64_t operator[](Verdict verdict) const { return camera[verdict] + aimed[verdict]; }
};

const char* name_of(RunEnd end) {
    return end == RunEnd::kDone ? "ok" : end == RunEnd::kCrashed ? "crash" : "no end";
}

/// The methods whose answers may differ, and the program's own tracer for its speed.
std::vector<Method> columns_of(const ChartScene& scene) {
    std::vector<Method> columns{single_method(scene)};
    std::vector<Method> boxes = box_methods(scene);
    // The first box method is the program's rule with its own boxes, which is in the list already.
    boxes.erase(boxes.begin());
    for (std::vector<Method> more : {rule_methods(scene), std::move(boxes), embree_methods(scene)})
        std::move(more.begin(), more.end(), std::back_inserter(columns));
    return columns;
}

/// Traces all rays on one thread and measures its processor time, in a process that may crash or
/// never end.
void measure(const ChartContext& context, const Method& method, const ChartSpace& space,
             const Judge& judge, Cell& cell) {
    const std::size_t pixels = space.camera_rays.size();
    const std::size_t rays = pixels + space.aimed_rays.size();
    const SharedMemory hits(rays * sizeof(Hit));
    const SharedMemory time(sizeof(double));
    cell.end = run_guarded(
        [&] {
            const double begin = thread_ms();
            method.trace(space.camera_rays, hits.as<Hit>(pixels));
            method.trace(space.aimed_rays, hits.as<Hit>(rays).subspan(pixels));
            time.as<double>(1)[0] = thread_ms() - begin;
        },
        kLimitS, context.check);
    if (cell.end != RunEnd::kDone) return;
    cell.mrays = static_cast<double>(rays) / (1e3 * time.as<double>(1)[0]);
    cell.camera = judge.camera(hits.as<Hit>(pixels));
    cell.aimed = judge.aimed(hits.as<Hit>(rays).subspan(pixels));
}

void add_cells(const ChartContext& context, const ChartInput& input, std::size_t row,
               std::vector<Cell>& cells) {
    const ChartScene scene = make_chart_scene(
        input.name, input.topology, input.positions, {},
        std::max(kChartTileSide, context.effort.side / kLessSide), context.effort.placed_rays);
    const Judge in_scene_space(scene, scene.scene_space);
    const Judge in_world_space(scene, scene.world_space);
    std::size_t column = 0;
    for (const Method& method : columns_of(scene)) {
        Cell& cell = cells.emplace_back();
        cell.row = row;
        cell.column = column++;
        cell.scene = input.name;
        cell.method = method.name;
        measure(context, method, method.space(scene),
                method.in_scene_space ? in_scene_space : in_world_space, cell);
    }
    context.step();
}

Table table_of(const std::vector<Cell>& cells) {
    Table table({"scene", "method", "row", "column", "rays", "wrong", "wrong/M", "leaks",
                 "false misses", "false hits", "wrong triangles", "close", "displaced", "beside",
                 "worst ulps", "end", "Mray/s"});
    for (const Cell& cell : cells) {
        std::vector<std::string> text{
            cell.scene,
            cell.method,
            fmt::format("{}", cell.row),
            fmt::format("{}", cell.column),
            fmt::format("{}", cell.rays()),
            fmt::format("{}", cell.wrong()),
            fmt::format("{:.4g}",
                        1e6 * static_cast<double>(cell.wrong()) /
                            static_cast<double>(std::max<std::uint64_t>(1, cell.rays())))};
        for (const Verdict verdict :
             {Verdict::kLeak, Verdict::kFalseMiss, Verdict::kFalseHit, Verdict::kWrongTriangle,
              Verdict::kClose, Verdict::kDisplaced, Verdict::kBeside}) {
            text.push_back(fmt::format("{}", cell[verdict]));
        }
        text.push_back(
            fmt::format("{:.3g}", std::max(cell.camera.worst_ulps, cell.aimed.worst_ulps)));
        text.emplace_back(name_of(cell.end));
        text.push_back(fmt::format("{:.3g}", cell.mrays));
        table.add(text);
    }
    return table;
}

}  // namespace

std::size_t failure_steps() { return failure_scenes().size(); }

Chart failure_chart(const ChartContext& context, const std::vector<ChartInput>& more) {
    std::vector<ChartInput> inputs;
    for (FailureScene& scene : failure_scenes())
        inputs.push_back({scene.name, std::move(scene.topology), std::move(scene.positions)});
    inputs.insert(inputs.end(), more.begin(), more.end());
    std::vector<Cell> cells;
    for (std::size_t row = 0; row < inputs.size(); ++row)
        add_cells(context, inputs[row], row, cells);

    const plot::Figure figure{.title = "Failure map: wrong answers per million rays; below, Mray/s",
                              .footer = context.footer,
                              .panel_height = static_cast<int>(42 * inputs.size() + 140),
                              .panels = {{.kind = "map",
                                          .x = "column",
                                          .y = "\"row\"",
                                          .series = "scene",
                                          .across = "method",
                                          .shade = "wrong/M",
                                          .note = "Mray/s",
                                          .end = "end"}}};
    return {"failures", table_of(cells), figure};
}

}  // namespace mray::accuracy
