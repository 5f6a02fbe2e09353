#include <fmt/format.h>

#include "app/chart/charts.h"
#include "app/chart/measure.h"

namespace morphray::app {
namespace {

constexpr std::uint32_t kSide = 128;

struct Cell {
    std::size_t row;
    std::size_t column;
    std::string scene;
    std::string contender;
    VerdictCounts camera;
    VerdictCounts aimed;

    std::uint64_t rays() const { return camera.rays + aimed.rays; }
    std::uint64_t wrong() const { return camera.wrong() + aimed.wrong(); }
    std::uint64_t operator[](Verdict verdict) const { return camera[verdict] + aimed[verdict]; }
};

void add_cells(const ChartContext& context, const ChartInput& input, std::size_t row,
               std::vector<Cell>& cells) {
    const ChartScene scene = make_chart_scene(input.name, input.topology, input.positions, {},
                                              kSide, context.effort.placed_rays);
    const Judge in_scene_space(scene, scene.scene_space);
    const Judge in_user_space(scene, scene.user_space);
    std::vector<Hit> camera(scene.scene_space.camera_rays.size());
    std::vector<Hit> aimed(scene.scene_space.aimed_rays.size());
    std::size_t column = 0;
    for (const std::vector<Contender>& group : {rule_contenders(scene), embree_contenders(scene)}) {
        for (const Contender& contender : group) {
            const Judge& judge = contender.in_scene_space ? in_scene_space : in_user_space;
            trace_camera(contender, scene, camera);
            trace_aimed(contender, scene, aimed);
            cells.push_back({row, column++, input.name, contender.name, judge.camera(camera),
                             judge.aimed(aimed)});
        }
    }
    context.step();
}

Table table_of(const std::vector<Cell>& cells) {
    Table table({"scene", "contender", "row", "column", "rays", "wrong", "wrong/M", "leaks",
                 "false misses", "false hits", "wrong triangles", "close", "displaced", "beside",
                 "worst ulps"});
    for (const Cell& cell : cells) {
        std::vector<std::string> text{
            cell.scene,
            cell.contender,
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

    const std::string name = "failures";
    PlotScript script;
    script.title = "Failure map: wrong answers per million rays (none: green)";
    script.footer = context.footer;
    script.width = 1300;
    script.height = static_cast<int>(260 + 42 * inputs.size());
    script.body = fmt::format(
        "set bmargin 8\nunset key\nunset grid\nset palette defined (0 '#a5d6a7', 0.01 '#fff59d', 3 "
        "'#ffb74d', 6 "
        "'#e53935')\nset cbrange [0:6]\nunset colorbox\nset yrange [{0}:-0.5]\nset xrange "
        "[-0.5:{1}]\nset xtics rotate by 20 right noenhanced\nset ytics noenhanced\nset tics out "
        "nomirror\n"
        "plot '{2}.csv' skip 1 using 4:3:($4-0.48):($4+0.48):($3-0.45):($3+0.45):($7 > 0 ? "
        "0.2 + (log10($7) > 0 ? log10($7) : 0) : 0):ytic(1):xtic(2) with boxxyerror fc palette "
        "fs solid, '' skip 1 using 4:3:($6 > 0 ? sprintf('%.0f', $7) : '0') with labels font "
        "',11'\n",
        static_cast<double>(inputs.size()) - 0.5,
        static_cast<double>(cells.empty() ? 0 : cells.back().column) + 0.5, name);
    return {name,
            "A row a scene, a column a contender. Half of the rays aim at vertices and edges. Red "
            "cells are scenes that a contender cannot be used for.",
            table_of(cells), script};
}

}  // namespace morphray::app
