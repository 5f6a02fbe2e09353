#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "accuracy/charts/charts.h"
#include "accuracy/measure/measure.h"
#include "tools/measure/thread_clock.h"
#include "tools/process/guarded_run.h"

namespace mray::accuracy {
namespace {

// Divides the effort's pixels a side.
constexpr std::uint32_t kLessSide = 8;
// Some thousand times the time that a cell takes.
constexpr unsigned kLimitS = 60;

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

/// No wrong answer, then up to 10 in a million, 100 ... 10^5, and more. Based on: C.
/// Brewer, M. Harrower. ColorBrewer, "YlOrBr". 2003; told apart with any colour vision.
constexpr std::array<std::uint32_t, 7> kWrongColours = {0xF2F7FA, 0xFFF7BC, 0xFEE391, 0xFEC44F,
                                                        0xFE9929, 0xEC7014, 0xA63603};
constexpr std::uint32_t kNoAnswerColour = 0x4A1486;
/// Colours from this one on take white text.
constexpr std::size_t kFirstDark = 6;

/// A square for each cell, with its figures.
plot::Panel map_of(const std::vector<Cell>& cells) {
    plot::Panel panel;
    for (const Cell& cell : cells) {
        if (cell.row == panel.y.names.size()) panel.y.names.push_back(cell.scene);
        if (cell.column == panel.x.names.size()) panel.x.names.push_back(cell.method);
        const bool is_done = cell.end == RunEnd::kDone;
        const double wrong = 1e6 * static_cast<double>(cell.wrong()) /
                             static_cast<double>(std::max<std::uint64_t>(1, cell.rays()));
        const std::size_t shade =
            wrong <= 0 ? 0
                       : std::clamp<std::size_t>(
                             static_cast<std::size_t>(std::max(0.0, std::log10(wrong))) + 1, 1,
                             kWrongColours.size() - 1);
        const bool is_dark = !is_done || shade >= kFirstDark;
        const auto x = static_cast<double>(cell.column);
        const auto y = static_cast<double>(cell.row);
        panel.rectangles.push_back({{x - 0.48, y - 0.46},
                                    {x + 0.48, y + 0.46},
                                    is_done ? kWrongColours[shade] : kNoAnswerColour});
        const std::uint32_t white = 0xFFFFFF;
        panel.texts.push_back({{x, y},
                               is_done ? fmt::format("{:.0f}", wrong) : name_of(cell.end),
                               is_dark ? white : plot::kTextColour,
                               is_done ? -0.4 : 0});
        if (!is_done) continue;
        panel.texts.push_back(
            {{x, y}, fmt::format("{:.2g}", cell.mrays), is_dark ? white : plot::kTextColour, 0.4});
    }
    return panel;
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

    const plot::Figure figure{
        .title = "Failure map: wrong answers per million rays; below, Mray/s",
        .footer = context.footer,
        .panel_width = static_cast<int>(84 * (cells.empty() ? 1 : cells.back().column + 1)),
        .panel_height = static_cast<int>(42 * inputs.size()),
        .panels = {map_of(cells)}};
    return {"failures",
            "Rows are scenes, columns are methods; one thread traces each cell. Most rays aim at "
            "vertices, edges and faces, some of them along an axis. Dark cells are scenes for "
            "which a method is unusable; violet cells ended in a crash, or not in time.",
            table_of(cells), figure};
}

}  // namespace mray::accuracy
