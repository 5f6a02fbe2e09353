#include "lab/accuracy/charts.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <map>

namespace mray::lab {

std::string number(double value) { return fmt::format("{:.4g}", value); }

Table table_with(std::vector<std::string> header) {
    const std::string rate = " [1/million]";
    header.insert(header.end(), {"rays",
                                 "judged exactly",
                                 "wrong",
                                 "wrong" + rate,
                                 "wrong lower 95 %" + rate,
                                 "wrong upper 95 %" + rate,
                                 "leaks",
                                 "false misses",
                                 "false hits",
                                 "wrong triangles",
                                 "close",
                                 "displaced",
                                 "beside",
                                 "t median [ulp]",
                                 "t 99 % [ulp]",
                                 "t largest [ulp]",
                                 "u 99 % [ulp of 1]",
                                 "u largest [ulp of 1]",
                                 "v 99 % [ulp of 1]",
                                 "v largest [ulp of 1]",
                                 "speed [Mray/s]",
                                 "speed lower quartile [Mray/s]",
                                 "speed upper quartile [Mray/s]"});
    return Table(std::move(header));
}

void add_row(Table& table, std::vector<std::string> row, const Score& score) {
    const Rate rate = rate_of(score.wrong(), score.rays);
    row.push_back(std::to_string(score.rays));
    row.push_back(std::to_string(score.exact));
    row.push_back(std::to_string(score.wrong()));
    for (const double part : {rate.value, rate.lower, rate.upper})
        row.push_back(number(1e6 * part));
    for (const Verdict verdict :
         {Verdict::kLeak, Verdict::kFalseMiss, Verdict::kFalseHit, Verdict::kWrongTriangle,
          Verdict::kClose, Verdict::kDisplaced, Verdict::kBeside})
        row.push_back(std::to_string(score[verdict]));
    const auto& [t, u, v] = score.errors;
    // Occlusion has no t.
    const bool has_t = t.count() > 0;
    for (const double error : {t.quantile(0.5), t.quantile(0.99), t.largest(), u.quantile(0.99),
                               u.largest(), v.quantile(0.99), v.largest()})
        row.push_back(has_t ? number(error) : "");
    const Spread spread = spread_of(score.mrays);
    for (const double speed : {score.mrays_per_second(), spread.lower, spread.upper})
        row.push_back(number(speed));
    table.add(std::move(row));
}

std::string count_text(std::uint64_t count) {
    if (count < 100'000) return std::to_string(count);
    return fmt::format("{:.3g} million", 1e-6 * static_cast<double>(count));
}

std::string shown_rate(const Score& score) {
    const Rate rate = rate_of(score.wrong(), score.rays);
    return number(1e6 * (score.wrong() == 0 ? rate.upper : rate.value));
}

namespace {

constexpr std::array kKinds = {RayKind::kPrimary, RayKind::kAimed, RayKind::kShadow,
                               RayKind::kDiffuse};

const char* title_of(RayKind kind) {
    switch (kind) {
        case RayKind::kPrimary:
            return "camera rays";
        case RayKind::kAimed:
            return "rays at vertices and edges, from shared origins";
        case RayKind::kShadow:
            return "shadow rays";
        default:
            return "rays at vertices, edges and faces, in any order";
    }
}

plot::Panel panel_of(const std::vector<ChartPoint>& points, RayKind kind, bool of_errors) {
    std::uint64_t most = 0;
    std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
    for (const ChartPoint& point : points) {
        if (point.kind != kind) continue;
        most = std::max(most, point.score.rays);
        least = std::min(least, point.score.rays);
    }
    const int threads = tbb::this_task_arena::max_concurrency();
    plot::Panel panel{
        {"kind", "points"},
        {"title", fmt::format("{}: {} to {}", title_of(kind), count_text(least), count_text(most))},
        {"where", "kind"},
        {"is", name_of(kind)},
        {"series", "method"},
        {"family", "family"},
        {"y", "speed [Mray/s]"},
        {"lower", "speed lower quartile [Mray/s]"},
        {"upper", "speed upper quartile [Mray/s]"},
        {"ylabel", fmt::format("Mray/s on {} thread{}", threads, threads == 1 ? "" : "s")},
        {"logx", "10"}};
    if (of_errors) {
        panel.insert({{"x", "t 99 % [ulp]"},
                      {"xlower", "t median [ulp]"},
                      {"xupper", "t largest [ulp]"},
                      {"xlabel", "error of t [ulp]: 99 %, from the median to the largest"}});
    } else {
        panel.insert({{"x", "shown [1/million]"},
                      {"xlower", "wrong lower 95 % [1/million]"},
                      {"xupper", "wrong upper 95 % [1/million]"},
                      {"hollow", "wrong"},
                      {"xlabel", kWrongLabel}});
    }
    return panel;
}

/// "packets (410 Mray/s, 0 of 10.5 million wrong)".
std::string text_of(const ChartPoint& point) {
    return fmt::format("{} ({} Mray/s, {} of {} wrong)", point.method,
                       number(point.score.mrays_per_second()), point.score.wrong(),
                       count_text(point.score.rays));
}

/// The fastest methods without a wrong answer and with some, for rays of a kind.
std::string sentence_of(const std::vector<ChartPoint>& points, RayKind kind) {
    const ChartPoint* right = nullptr;
    const ChartPoint* wrong = nullptr;
    for (const ChartPoint& point : points) {
        if (point.kind != kind) continue;
        const ChartPoint*& best = point.score.wrong() == 0 ? right : wrong;
        if (best == nullptr || point.score.mrays_per_second() > best->score.mrays_per_second())
            best = &point;
    }
    std::string text = fmt::format("{}: ", title_of(kind));
    text += right != nullptr ? "the fastest without a wrong answer is " + text_of(*right)
                             : "every method has wrong answers";
    if (wrong != nullptr) text += "; of the others " + text_of(*wrong);
    return text;
}

/// The failure chart has fewer columns: no HIGH trees, no brute force, no devices.
std::vector<ChartTracer> failure_tracers(const ChartMethods& methods, const ChartRays& rays) {
    std::vector<ChartTracer> tracers = methods(rays);
    std::erase_if(tracers, [](const ChartTracer& one) {
        return one.method.find("HIGH") != std::string::npos || one.method == "brute force" ||
               one.method == "scalar";
    });
    return tracers;
}

}  // namespace

std::size_t count_steps(const Effort& effort, std::span<const ChartInput> inputs) {
    std::size_t steps = failure_scenes().size();
    for (const ChartInput& input : inputs)
        steps += kKinds.size() * effort.chunks + input.frames.size() + 1;
    return steps;
}

Chart accuracy_chart(const ChartContext& context, const ChartInput& input,
                     const std::string& suffix) {
    const ChartScene scene = make_chart_scene(input);
    const ChartMethods methods(scene, context.devices);
    std::vector<ChartPoint> points;
    for (const RayKind kind : kKinds)
        std::ranges::move(measure(scene, std::cref(methods), kind, context.effort, context.done),
                          std::back_inserter(points));
    Table table = table_with({"kind", "method", "family", "space", "shown [1/million]"});
    for (const ChartPoint& point : points) {
        add_row(table,
                {name_of(point.kind), point.method, point.family,
                 point.in_scene_space ? "scene" : "world", shown_rate(point.score)},
                point.score);
    }
    std::string sentence;
    for (const RayKind kind : kKinds) sentence += sentence_of(points, kind) + ". ";
    plot::Figure wrong{.title = fmt::format("Speed against wrong answers on {} ({} triangles). {}",
                                            input.name, input.topology.triangles.size(), sentence),
                       .footer = context.footer,
                       .panel_height = 340,
                       .panels = {}};
    plot::Figure errors = wrong;
    errors.title =
        fmt::format("Speed against the error of t, of right answers, on {} ({} triangles)",
                    input.name, input.topology.triangles.size());
    for (const RayKind kind : kKinds) {
        wrong.panels.push_back(panel_of(points, kind, false));
        if (kind != RayKind::kShadow) errors.panels.push_back(panel_of(points, kind, true));
    }
    return {"accuracy" + suffix,
            std::move(table),
            {{"accuracy" + suffix, std::move(wrong)}, {"errors" + suffix, std::move(errors)}}};
}

Chart failure_chart(const ChartContext& context, const std::vector<ChartInput>& more) {
    const Effort effort{.chunk_rays = context.effort.failure_rays,
                        .chunks = 1,
                        .slow_chunks = 1,
                        .failure_rays = 0};
    std::vector<ChartInput> inputs = failure_scenes();
    inputs.insert(inputs.end(), more.begin(), more.end());
    Table table = table_with({"scene", "method", "row", "column", "time [1/ordinary]"});
    // By method: its column, its time on the first scene, and on how many scenes it is wrong.
    struct Column {
        std::string method;
        double ordinary = 0;
        double slowest = 0;
        std::string slowest_scene;
        std::size_t failures = 0;
    };
    std::vector<Column> columns;
    for (std::size_t row = 0; row < inputs.size(); ++row) {
        const ChartScene scene = make_chart_scene(inputs[row]);
        const ChartMethods methods(scene, {});
        std::map<std::string, Score> sums;
        std::vector<std::string> order;
        for (const RayKind kind : {RayKind::kPrimary, RayKind::kAimed, RayKind::kDiffuse}) {
            const auto tracers = [&](const ChartRays& rays) {
                return failure_tracers(methods, rays);
            };
            for (const ChartPoint& point : measure(scene, tracers, kind, effort, [] {})) {
                if (!sums.contains(point.method)) order.push_back(point.method);
                sums[point.method] += point.score;
            }
        }
        for (const std::string& method : order) {
            const Score& score = sums.at(method);
            const double time = score.ms / static_cast<double>(score.rays);
            if (row == 0) columns.push_back({method, time, 1, inputs[row].name, 0});
            const auto column = std::ranges::find(columns, method, &Column::method);
            const double ratio = time / column->ordinary;
            if (ratio > column->slowest) {
                column->slowest = ratio;
                column->slowest_scene = inputs[row].name;
            }
            column->failures += score.wrong() > 0;
            add_row(table,
                    {inputs[row].name, method, std::to_string(row),
                     std::to_string(column - columns.begin()), number(ratio)},
                    score);
        }
        context.done();
    }
    std::vector<std::string> never;
    std::vector<std::string> others;
    std::vector<std::string> slow;
    const auto list = [](const std::vector<std::string>& names) {
        return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
    };
    for (const Column& column : columns) {
        if (column.failures == 0)
            never.push_back(column.method);
        else
            others.push_back(fmt::format("{} on {}", column.method, column.failures));
        slow.push_back(
            fmt::format("{} {:.2g} ({})", column.method, column.slowest, column.slowest_scene));
    }
    const auto map = [&](std::string title, const char* shade, const char* digits) {
        return plot::Figure{.title = std::move(title),
                            .footer = context.footer,
                            .width = 800,
                            .panel_height = static_cast<int>(28 * inputs.size()),
                            .panels = {{{"kind", "map"},
                                        {"x", "column"},
                                        {"y", "row"},
                                        {"series", "scene"},
                                        {"across", "method"},
                                        {"shade", shade},
                                        {"digits", digits}}}};
    };
    plot::Figure wrong =
        map(fmt::format("Wrong answers per million rays on {} scenes. Never wrong: {}. Wrong: {}",
                        inputs.size(), list(never), list(others)),
            "wrong [1/million]", "0");
    plot::Figure errors =
        map("Error of t of right answers: 99 % are at most so many ulp off", "t 99 % [ulp]", "1");
    plot::Figure time = map(fmt::format("Time of a ray over that on the first scene. Slowest: {}",
                                        fmt::join(slow, ", ")),
                            "time [1/ordinary]", "1");
    return {"failures",
            std::move(table),
            {{"failures", std::move(wrong)},
             {"failures_t", std::move(errors)},
             {"failures_time", std::move(time)}}};
}

}  // namespace mray::lab
