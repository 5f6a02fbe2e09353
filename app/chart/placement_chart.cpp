#include <fmt/format.h>

#include "app/chart/charts.h"
#include "app/chart/measure.h"

namespace morphray::app {
namespace {

constexpr std::uint32_t kSide = 32;

struct Row {
    std::string contender;
    Placement placement;
    VerdictCounts counts;
};

/// Those that differ in what they answer: all of ours give the same bits.
std::vector<Contender> different_contenders(const ChartScene& scene) {
    std::vector<Contender> all = rule_contenders(scene);
    for (Contender& contender : embree_contenders(scene)) all.push_back(std::move(contender));
    return all;
}

void add_rows(const ChartContext& context, const ChartInput& input, const Placement& placement,
              std::vector<Row>& rows) {
    const ChartScene scene = make_chart_scene(input.name, input.topology, input.positions,
                                              placement, kSide, context.effort.placed_rays);
    const Judge in_scene_space(scene, scene.scene_space);
    const Judge in_user_space(scene, scene.user_space);
    std::vector<Hit> hits(scene.scene_space.aimed_rays.size());
    for (const Contender& contender : different_contenders(scene)) {
        trace_aimed(contender, scene, hits);
        const Judge& judge = contender.in_scene_space ? in_scene_space : in_user_space;
        rows.push_back({contender.name, placement, judge.aimed(hits)});
    }
    context.step();
}

Table table_of(const std::vector<Row>& rows) {
    Table table({"contender", "offset", "scale", "rays", "wrong", "wrong/M", "leaks",
                 "false misses", "false hits", "wrong triangles", "close", "displaced"});
    for (const Row& row : rows) {
        std::vector<std::string> cells{row.contender,
                                       fmt::format("{:g}", row.placement.offset),
                                       fmt::format("{:g}", row.placement.scale),
                                       fmt::format("{}", row.counts.rays),
                                       fmt::format("{}", row.counts.wrong()),
                                       fmt::format("{:.4g}", row.counts.wrong_per_million())};
        for (const Verdict verdict :
             {Verdict::kLeak, Verdict::kFalseMiss, Verdict::kFalseHit, Verdict::kWrongTriangle,
              Verdict::kClose, Verdict::kDisplaced}) {
            cells.push_back(fmt::format("{}", row.counts[verdict]));
        }
        table.add(cells);
    }
    return table;
}

/// `column` of the table is x; rows where `other` is not `at` are left out.
std::string panel(const std::string& title, const std::string& file,
                  const std::vector<std::string>& contenders, int column, int other, double at,
                  double least_x) {
    std::string text = fmt::format(
        "set title '{}' font ',12'\nunset logscale\nset yrange [0.1:2e6]\nset xrange [{}:*]\nset "
        "logscale xy\n"
        "set xlabel '{}'\nset ylabel 'wrong answers per million rays (0 drawn at 0.2)'\n"
        "set xtics 10 format '10^{{%T}}'\nset ytics 10 format '10^{{%T}}'\nset key top left "
        "noenhanced\nplot ",
        title, least_x / 3, column == 2 ? "offset / size (0 drawn at the left)" : "scale");
    for (std::size_t i = 0; i < contenders.size(); ++i) {
        // Lines that lie on each other are told apart by moving them a little.
        text += fmt::format(
            "{0}'{1}.csv' skip 1 using (strcol(1) eq {2} && ${3} == {4} ? (${5} > 0 ? ${5} : "
            "{6}) : NaN):(($6 > 0 ? $6 : 0.2) * {7:.3f}) with points pt {8} ps 1.2 lw 2 lc {8} "
            "title {2}",
            i == 0 ? "" : ", ", file, plot_quoted(contenders[i]), other, at, column, least_x,
            1 + 0.04 * static_cast<double>(i), i + 1);
    }
    return text + "\n";
}

}  // namespace

std::size_t placement_steps(const Effort& effort) {
    return 1 + effort.offsets.size() + effort.scales.size();
}

Chart placement_chart(const ChartContext& context, const ChartInput& input,
                      const std::string& suffix) {
    std::vector<Row> rows;
    add_rows(context, input, {}, rows);
    std::vector<std::string> contenders;
    for (const Row& row : rows) contenders.push_back(row.contender);
    for (const double offset : context.effort.offsets)
        add_rows(context, input, {.offset = offset}, rows);
    for (const double scale : context.effort.scales)
        add_rows(context, input, {.scale = scale}, rows);

    const std::string name = "placement" + suffix;
    PlotScript script;
    script.title = fmt::format("Far from the origin, tiny and huge: {}, {} triangles", input.name,
                               input.topology.triangles.size());
    script.footer = context.footer;
    script.width = 1500;
    script.height = 700;
    script.layout = "1,2";
    script.body =
        panel("moved along (1, 1, 1)", name, contenders, 2, 3, 1, context.effort.offsets[0] / 10) +
        "unset label 1\n" + panel("scaled", name, contenders, 3, 2, 0, context.effort.scales[0]);
    return {name,
            "Rays at vertices, edges and faces. Every answer is held against the exact one for the "
            "floats that the contender was given, so coordinates that were rounded away by the "
            "offset are nobody's mistake.",
            table_of(rows), script};
}

}  // namespace morphray::app
