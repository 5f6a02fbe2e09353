#include "lab/accuracy/charts/charts.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>

namespace mray::accuracy {
namespace {

// The failure chart's image has so many times fewer pixels a side.
constexpr std::uint32_t kLessSide = 8;

Table table_with(std::vector<std::string> header) {
    header.insert(header.end(), {"Mray/s", "leaks", "false misses", "false hits", "wrong triangles",
                                 "close", "displaced", "beside"});
    return Table(header);
}

void add_row(Table& table, std::vector<std::string> row, const Measured& measured) {
    const VerdictCounts both = measured.camera + measured.aimed;
    row.push_back(fmt::format("{:.4g}", measured.mrays));
    for (const Verdict verdict :
         {Verdict::kLeak, Verdict::kFalseMiss, Verdict::kFalseHit, Verdict::kWrongTriangle,
          Verdict::kClose, Verdict::kDisplaced, Verdict::kBeside})
        row.push_back(std::to_string(both[verdict]));
    table.add(row);
}

void add_counts(std::vector<std::string>& row, const VerdictCounts& counts) {
    row.push_back(std::to_string(counts.rays));
    row.push_back(std::to_string(counts.wrong()));
    row.push_back(fmt::format("{:.4g}", counts.wrong_per_million()));
}

plot::Panel panel_of(const std::string& title, const std::string& rays, std::uint64_t count) {
    const double one = 1e6 / static_cast<double>(std::max<std::uint64_t>(1, count));
    const int threads = tbb::this_task_arena::max_concurrency();
    return {{"kind", "points"},
            {"title", title},
            {"x", rays + " wrong/M"},
            {"y", "Mray/s"},
            {"series", "method"},
            {"xlabel", fmt::format("wrong answers per million rays (one ray: {:.2g})", one)},
            {"ylabel", fmt::format("Mray/s on {} thread{}", threads, threads == 1 ? "" : "s")},
            {"logx", "10"}};
}

/// "5 of 9 methods have no wrong answer; the fastest of them is packets with 102 Mray/s".
std::string sentence_of(const std::vector<Measured>& points) {
    const Measured* fastest = nullptr;
    std::size_t right = 0;
    for (const Measured& point : points) {
        if (point.camera.wrong() + point.aimed.wrong() > 0) continue;
        ++right;
        if (fastest == nullptr || point.mrays > fastest->mrays) fastest = &point;
    }
    if (right == 0) return fmt::format("each of {} methods has wrong answers", points.size());
    return fmt::format(
        "{} of {} methods have no wrong answer; the fastest of them is {} with {:.3g} Mray/s",
        right, points.size(), fastest->method, fastest->mrays);
}

std::vector<Method> with_peers(std::vector<Method> methods, const ChartScene& scene) {
    for (std::vector<Method> more : {rule_methods(scene), embree_methods(scene)})
        std::move(more.begin(), more.end(), std::back_inserter(methods));
    return methods;
}

}  // namespace

Chart accuracy_chart(const ChartContext& context, const ChartInput& input,
                     const std::string& suffix) {
    const Effort& effort = context.effort;
    const ChartScene scene = make_chart_scene(input, effort.side, effort.aimed_rays);
    const std::vector<Measured> points = measure(
        scene, with_peers(our_methods(scene, context.make_vulkan_backend), scene), effort.rounds);
    Table table = table_with({"method", "camera rays", "camera wrong", "camera wrong/M",
                              "aimed rays", "aimed wrong", "aimed wrong/M"});
    for (const Measured& point : points) {
        std::vector<std::string> row = {point.method};
        for (const VerdictCounts& counts : {point.camera, point.aimed}) add_counts(row, counts);
        add_row(table, row, point);
    }
    const std::size_t pixels = scene.scene_space.camera_rays.size();
    const std::size_t aimed = scene.scene_space.aimed_rays.size();
    const plot::Figure figure{
        .title = fmt::format("Speed against accuracy on {} ({} triangles): {}", input.name,
                             input.topology.triangles.size(), sentence_of(points)),
        .footer = context.footer,
        .panel_height = 300,
        .panels = {
            panel_of(fmt::format("{} pixels of a camera", pixels), "camera", pixels),
            panel_of(fmt::format("{} rays at vertices, edges, faces", aimed), "aimed", aimed)}};
    return {"accuracy" + suffix, table, figure};
}

Chart failure_chart(const ChartContext& context, const std::vector<ChartInput>& more) {
    std::vector<ChartInput> inputs = failure_scenes();
    inputs.insert(inputs.end(), more.begin(), more.end());
    Table table = table_with({"scene", "method", "row", "column", "rays", "wrong", "wrong/M"});
    // The methods, and on how many scenes each is wrong.
    std::vector<std::pair<std::string, std::size_t>> failures;
    for (std::size_t row = 0; row < inputs.size(); ++row) {
        const ChartScene scene =
            make_chart_scene(inputs[row], std::max(kChartTileSide, context.effort.side / kLessSide),
                             context.effort.failure_rays);
        const std::vector<Measured> cells =
            measure(scene, with_peers({single_method(scene)}, scene), 1);
        for (std::size_t column = 0; column < cells.size(); ++column) {
            std::vector<std::string> text = {inputs[row].name, cells[column].method,
                                             std::to_string(row), std::to_string(column)};
            const VerdictCounts counts = cells[column].camera + cells[column].aimed;
            add_counts(text, counts);
            if (row == 0) failures.emplace_back(cells[column].method, 0);
            failures[column].second += counts.wrong() > 0;
            add_row(table, text, cells[column]);
        }
    }
    std::vector<std::string> never;
    std::vector<std::string> others;
    for (const auto& [method, scenes] : failures) {
        if (scenes == 0)
            never.push_back(method);
        else
            others.push_back(fmt::format("{} on {}", method, scenes));
    }
    const plot::Figure figure{
        .title =
            fmt::format("Wrong answers per million rays on {} scenes. Never wrong: {}. Wrong: {}",
                        inputs.size(), fmt::join(never, ", "), fmt::join(others, ", ")),
        .footer = context.footer,
        .panel_height = static_cast<int>(28 * inputs.size()),
        .panels = {{{"kind", "map"},
                    {"x", "column"},
                    {"y", "row"},
                    {"series", "scene"},
                    {"across", "method"},
                    {"shade", "wrong/M"}}}};
    return {"failures", table, figure};
}

}  // namespace mray::accuracy
