#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "lab/accuracy/charts/charts.h"
#include "lab/accuracy/measure.h"

namespace mray::accuracy {
namespace {

constexpr std::uint32_t kSide = 32;

struct Row {
    /// "offset" or "scale", and its value.
    std::string series;
    double x;
    /// The index of the method.
    std::size_t order;
    std::string method;
    VerdictCounts counts;
};

/// The methods whose answers may differ; all tracers of the program give the same bits.
std::vector<Method> different_methods(const ChartScene& scene) {
    std::vector<Method> all = rule_methods(scene);
    for (Method& method : embree_methods(scene)) all.push_back(std::move(method));
    return all;
}

void add_rows(const ChartContext& context, const ChartInput& input, const std::string& series,
              double x, std::vector<Row>& rows) {
    const Placement placement{.offset = series == "offset" ? x : 0,
                              .scale = series == "scale" ? x : 1};
    const ChartScene scene = make_chart_scene(input, placement, kSide, context.effort.placed_rays);
    const Judge in_scene_space(scene, scene.scene_space);
    const Judge in_world_space(scene, scene.world_space);
    std::vector<Hit> hits(scene.scene_space.aimed_rays.size());
    std::size_t order = 0;
    for (const Method& method : different_methods(scene)) {
        trace_aimed(method, scene, hits);
        const Judge& judge = method.in_scene_space ? in_scene_space : in_world_space;
        rows.push_back({series, x, order++, method.name, judge.aimed(hits)});
    }
    context.step();
}

Table table_of(const std::vector<Row>& rows) {
    std::vector<std::string> header = {"method", "series", "x", "rays", "wrong", "wrong/M"};
    header.insert(header.end(), kVerdictColumns.begin(), kVerdictColumns.end());
    Table table(header);
    for (const Row& row : rows) {
        std::vector<std::string> cells{row.method,
                                       row.series,
                                       fmt::format("{:g}", row.x),
                                       fmt::format("{}", row.counts.rays),
                                       fmt::format("{}", row.counts.wrong()),
                                       fmt::format("{:.4g}", row.counts.wrong_per_million())};
        for (const std::string& cell : verdict_cells(row.counts)) cells.push_back(cell);
        table.add(cells);
    }
    return table;
}

/// The lines of one series.
plot::Panel panel_of(const std::string& title, const std::string& series) {
    return {.kind = "lines",
            .title = title,
            .x = "x",
            .y = "\"wrong/M\"",
            .series = "method",
            .xlabel = series == "offset" ? "offset / size" : "scale",
            .ylabel = "wrong answers per million rays",
            .where = "series",
            .is = series,
            .logx = "10"};
}

}  // namespace

std::size_t placement_steps(const Effort& effort) {
    return 1 + effort.offsets.size() + effort.scales.size();
}

Chart placement_chart(const ChartContext& context, const ChartInput& input,
                      const std::string& suffix) {
    std::vector<Row> rows;
    add_rows(context, input, "offset", 0, rows);
    for (const double offset : context.effort.offsets)
        add_rows(context, input, "offset", offset, rows);
    for (const double scale : context.effort.scales) add_rows(context, input, "scale", scale, rows);
    // The points of a line must be adjacent and in order.
    std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
        return std::tie(a.series, a.order, a.x) < std::tie(b.series, b.order, b.x);
    });

    const plot::Figure figure{
        .title = fmt::format("Far from the origin, tiny and huge: {}, {} triangles", input.name,
                             input.topology.triangles.size()),
        .footer = context.footer,
        .columns = 2,
        .panel_height = 440,
        .panels = {panel_of("moved along (1, 1, 1)", "offset"), panel_of("scaled", "scale")}};
    return {"placement" + suffix, table_of(rows), figure};
}

}  // namespace mray::accuracy
