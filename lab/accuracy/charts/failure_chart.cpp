#include <fmt/format.h>

#include <algorithm>
#include <ctime>

#include "common/report/guarded_run.h"
#include "lab/accuracy/charts/charts.h"
#include "lab/accuracy/measure.h"

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
    VerdictCounts counts;
    RunEnd end = RunEnd::kDone;
    double mrays = 0;
};

const char* name_of(RunEnd end) {
    return end == RunEnd::kDone ? "ok" : end == RunEnd::kCrashed ? "crash" : "no end";
}

/// The methods whose answers may differ, and the program's own tracer for its speed.
std::vector<Method> columns_of(const ChartScene& scene) {
    std::vector<Method> columns{single_method(scene)};
    for (std::vector<Method> more : {rule_methods(scene), embree_methods(scene)})
        std::move(more.begin(), more.end(), std::back_inserter(columns));
    return columns;
}

/// Traces all rays on one thread and measures its processor time, in a process that may crash or
/// never end.
void measure(const Method& method, const ChartSpace& space, const Judge& judge, Cell& cell) {
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
        kLimitS);
    if (cell.end != RunEnd::kDone) return;
    cell.mrays = static_cast<double>(rays) / (1e3 * time.as<double>(1)[0]);
    cell.counts =
        judge.camera(hits.as<Hit>(pixels)) + judge.aimed(hits.as<Hit>(rays).subspan(pixels));
}

void add_cells(const ChartContext& context, const ChartInput& input, std::size_t row,
               std::vector<Cell>& cells) {
    const ChartScene scene =
        make_chart_scene(input, std::max(kChartTileSide, context.effort.side / kLessSide),
                         context.effort.failure_rays);
    const Judge in_scene_space(scene, scene.scene_space);
    const Judge in_world_space(scene, scene.world_space);
    std::size_t column = 0;
    for (const Method& method : columns_of(scene)) {
        Cell& cell = cells.emplace_back();
        cell.row = row;
        cell.column = column++;
        cell.scene = input.name;
        cell.method = method.name;
        measure(method, method.space(scene),
                method.in_scene_space ? in_scene_space : in_world_space, cell);
    }
}

Table table_of(const std::vector<Cell>& cells) {
    std::vector<std::string> header = {"scene", "method", "row",    "column",
                                       "rays",  "wrong",  "wrong/M"};
    header.insert(header.end(), kVerdictColumns.begin(), kVerdictColumns.end());
    header.insert(header.end(), {"worst ulps", "end", "Mray/s"});
    Table table(header);
    for (const Cell& cell : cells) {
        std::vector<std::string> text{cell.scene,
                                      cell.method,
                                      std::to_string(cell.row),
                                      std::to_string(cell.column),
                                      std::to_string(cell.counts.rays),
                                      std::to_string(cell.counts.wrong()),
                                      fmt::format("{:.4g}", cell.counts.wrong_per_million())};
        for (const std::string& count : verdict_cells(cell.counts)) text.push_back(count);
        text.push_back(fmt::format("{:.3g}", cell.counts.worst_ulps));
        text.emplace_back(name_of(cell.end));
        text.push_back(fmt::format("{:.3g}", cell.mrays));
        table.add(text);
    }
    return table;
}

}  // namespace

Chart failure_chart(const ChartContext& context, const std::vector<ChartInput>& more) {
    std::vector<ChartInput> inputs = failure_scenes();
    inputs.insert(inputs.end(), more.begin(), more.end());
    std::vector<Cell> cells;
    for (std::size_t row = 0; row < inputs.size(); ++row)
        add_cells(context, inputs[row], row, cells);

    const plot::Figure figure{.title = "Failure map: wrong answers per million rays; below, Mray/s",
                              .footer = context.footer,
                              .panel_height = static_cast<int>(42 * inputs.size() + 140),
                              .panels = {{.kind = "map",
                                          .x = "column",
                                          .y = "row",
                                          .series = "scene",
                                          .across = "method",
                                          .shade = "wrong/M",
                                          .note = "Mray/s",
                                          .end = "end"}}};
    return {"failures", table_of(cells), figure};
}

}  // namespace mray::accuracy
