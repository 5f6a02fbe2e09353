#include "lab/accuracy/charts.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include "common/text/text.h"
#include "common/update/tree_updater.h"
#include "cpu/cpu_backend.h"
#include "lab/methods/paper_2007.h"
#include "lab/methods/report.h"

namespace mray::lab {
namespace {

/// Four digits.
std::string number(double value) { return fmt::format("{:.4g}", value); }

/// Columns that every chart has.
constexpr std::string_view kColumns =
    "rays,judged exactly,wrong,wrong [1/million],wrong lower 95 % [1/million],"
    "wrong upper 95 % [1/million],leaks,false misses,false hits,wrong triangles,close,displaced,"
    "beside,t median [ulp],t 99 % [ulp],t largest [ulp],u 99 % [ulp of 1],u largest [ulp of 1],"
    "v 99 % [ulp of 1],v largest [ulp of 1],speed [Mray/s],speed lower quartile [Mray/s],"
    "speed upper quartile [Mray/s]";

Table table_with(std::vector<std::string> header) {
    for (const std::string_view column : split(kColumns, ',')) header.emplace_back(column);
    return Table(std::move(header));
}

/// Adds the cells of the common columns to those of the row's own.
void add_row(Table& table, std::vector<std::string> row, const Score& score) {
    const Rate rate = rate_of(score.wrong(), score.rays);
    for (const std::uint64_t count : {score.rays, score.exact, score.wrong()})
        row.push_back(std::to_string(count));
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

/// "4096", "10.5 million".
std::string count_text(std::uint64_t count) {
    if (count < 100'000) return std::to_string(count);
    return fmt::format("{:.3g} million", 1e-6 * static_cast<double>(count));
}

/// Wrong answers per million, or the upper bound if there are none.
std::string shown_rate(const Score& score) {
    const Rate rate = rate_of(score.wrong(), score.rays);
    return number(1e6 * (score.wrong() == 0 ? rate.upper : rate.value));
}

/// The speed of rays of a kind, by method, with the variables of a panel of its own.
plot::Panel speed_panel(RayKind kind, std::string title, plot::Panel own) {
    const int threads = tbb::this_task_arena::max_concurrency();
    own.insert(
        {{"title", std::move(title)},
         {"where", "kind"},
         {"is", name_of(kind)},
         {"series", "method"},
         {"y", "speed [Mray/s]"},
         {"lower", "speed lower quartile [Mray/s]"},
         {"upper", "speed upper quartile [Mray/s]"},
         {"ylabel", fmt::format("Mray/s on {} thread{}", threads, threads == 1 ? "" : "s")}});
    return own;
}

const plot::Panel kAgainstWrong = {
    {"kind", "points"},
    {"x", "shown [1/million]"},
    {"xlower", "wrong lower 95 % [1/million]"},
    {"xupper", "wrong upper 95 % [1/million]"},
    {"xlabel", "wrong per million (hollow: none seen, at its upper bound)"},
    {"hollow", "wrong"},
    {"logx", "10"}};

const plot::Panel kAgainstError = {
    {"kind", "points"},
    {"x", "t 99 % [ulp]"},
    {"xlower", "t median [ulp]"},
    {"xupper", "t largest [ulp]"},
    {"xlabel", "error of t [ulp]: 99 %, from the median to the largest"},
    {"logx", "10"}};

struct TitledKind {
    RayKind kind;
    const char* title;
};
constexpr TitledKind kKinds[] = {
    {RayKind::kPrimary, "camera rays"},
    {RayKind::kAimed, "rays at vertices and edges, from shared origins"},
    {RayKind::kShadow, "shadow rays"},
    {RayKind::kDiffuse, "rays at vertices, edges and faces, in any order"}};

plot::Panel panel_of(const std::vector<ChartPoint>& points, const TitledKind& rays,
                     plot::Panel own) {
    std::uint64_t most = 0;
    std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
    for (const ChartPoint& point : points) {
        if (point.kind != rays.kind) continue;
        most = std::max(most, point.score.rays);
        least = std::min(least, point.score.rays);
    }
    own["family"] = "family";
    return speed_panel(rays.kind,
                       fmt::format("{}: {} to {}", rays.title, count_text(least), count_text(most)),
                       std::move(own));
}

/// "packets (410 Mray/s, 0 of 10.5 million wrong)".
std::string text_of(const ChartPoint& point) {
    return fmt::format("{} ({} Mray/s, {} of {} wrong)", point.method,
                       number(point.score.mrays_per_second()), point.score.wrong(),
                       count_text(point.score.rays));
}

/// The fastest methods without a wrong answer and with some, for rays of a kind.
std::string sentence_of(const std::vector<ChartPoint>& points, const TitledKind& rays) {
    const ChartPoint* right = nullptr;
    const ChartPoint* wrong = nullptr;
    for (const ChartPoint& point : points) {
        if (point.kind != rays.kind) continue;
        const ChartPoint*& best = point.score.wrong() == 0 ? right : wrong;
        if (best == nullptr || point.score.mrays_per_second() > best->score.mrays_per_second())
            best = &point;
    }
    std::string text = fmt::format("{}: ", rays.title);
    text += right != nullptr ? "the fastest without a wrong answer is " + text_of(*right)
                             : "every method has wrong answers";
    if (wrong != nullptr) text += "; of the others " + text_of(*wrong);
    return text;
}

/// Restructures the refitted tree in every frame.
class RestructureAlways : public UpdatePolicy {
public:
    UpdateDecision plan() override { return {UpdateStep::kRefit, "first"}; }
    UpdateDecision review(const RefittedTree& tree) override {
        return {tree.restructured ? UpdateStep::kRefit : UpdateStep::kRestructure, "always"};
    }
    bool needs_tree_cost() const override { return true; }
};

/// A tree that follows the frames, and packets over it.
struct Updated {
    std::string method;
    std::string family;
    /// Brings the tree to the frame. This is timed.
    std::function<void(const ChartScene& frame)> update;
    std::function<Tracer(const ChartRays& rays)> tracer;
};

/// The topology outlives it.
Updated ours(std::string method, const Topology& topology, const ChartScene& first,
             std::unique_ptr<UpdatePolicy> policy) {
    const auto pose = std::make_shared<Pose>(first.scene_space.positions);
    const std::shared_ptr<Backend> backend = cpu::make_cpu_backend();
    const auto updater =
        std::make_shared<TreeUpdater>(topology, *pose, *backend, std::move(policy), BuildConfig{},
                                      UpdateConfig{}, &first.scene_space.bvh);
    return {std::move(method), "ours",
            [pose, backend, updater](const ChartScene& frame) {
                pose->move_to(frame.scene_space.positions);
                updater->update();
            },
            [backend](const ChartRays& rays) {
                return packet_tracer(backend->host_tree(), best_simd_target(), rays.scene_space);
            }};
}

Updated of_2007(std::string method, const ChartScene& first, bool rebuilds) {
    const auto tree =
        std::make_shared<PeerTree>(build_paper_tree(first.topology, first.scene_space.positions));
    return {std::move(method), "2007",
            [tree, rebuilds](const ChartScene& frame) {
                if (rebuilds) *tree = build_paper_tree(frame.topology, frame.scene_space.positions);
                refit(*tree, frame.topology, frame.world_space.positions);
            },
            [tree](const ChartRays& rays) { return paper_tracer(*tree, rays.world_space); }};
}

/// Rays whose speed counts, and rays that are hard to answer.
constexpr std::array kFrameKinds = {RayKind::kPrimary, RayKind::kAimed};

/// What one way to update a tree does in one frame.
struct FrameScore {
    double update_ms = 0;
    /// By kind.
    std::array<Score, kFrameKinds.size()> scores;

    /// An update and a trace of camera rays.
    double ms() const { return update_ms + scores[0].ms; }
};

/// "in frame 12" or "in no frame": when the traces of the refitted tree have lost more time
/// than a build takes.
std::string rebuild_text(std::span<const double> frames,
                         std::span<const std::vector<FrameScore>> scores, std::size_t refitted,
                         std::size_t rebuilt) {
    double lost = 0;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        lost += scores[i][refitted].scores[0].ms - scores[i][rebuilt].scores[0].ms;
        if (lost > scores[i][rebuilt].update_ms) return fmt::format("in frame {}", frames[i]);
    }
    return "in no frame";
}

}  // namespace

std::size_t count_steps(const Effort& effort, std::span<const ChartInput> inputs) {
    std::size_t steps = failure_scenes().size();
    for (const ChartInput& input : inputs)
        steps += std::size(kKinds) * effort.chunks + input.frames.size() + 1;
    return steps;
}

Chart accuracy_chart(const ChartContext& context, const ChartInput& input,
                     const std::string& suffix) {
    const ChartScene scene = make_chart_scene(input);
    const MakeTracers methods = chart_methods(scene, context.devices);
    std::vector<ChartPoint> points;
    std::string sentence;
    for (const TitledKind& rays : kKinds) {
        std::ranges::move(measure(scene, methods, rays.kind, context.effort, context.done),
                          std::back_inserter(points));
        sentence += sentence_of(points, rays) + ". ";
    }
    Table table = table_with({"kind", "method", "family", "space", "shown [1/million]"});
    for (const ChartPoint& point : points) {
        add_row(table,
                {name_of(point.kind), point.method, point.family,
                 in_scene_space(point.family) ? "scene" : "world", shown_rate(point.score)},
                point.score);
    }
    plot::Figure wrong{.title = fmt::format("Speed against wrong answers on {} ({} triangles). {}",
                                            input.name, input.topology.triangles.size(), sentence),
                       .footer = context.footer,
                       .panel_height = 340,
                       .panels = {}};
    plot::Figure errors = wrong;
    errors.title =
        fmt::format("Speed against the error of t, of right answers, on {} ({} triangles)",
                    input.name, input.topology.triangles.size());
    for (const TitledKind& rays : kKinds) {
        wrong.panels.push_back(panel_of(points, rays, kAgainstWrong));
        if (rays.kind != RayKind::kShadow)
            errors.panels.push_back(panel_of(points, rays, kAgainstError));
    }
    return {"accuracy" + suffix,
            std::move(table),
            {{"accuracy" + suffix, std::move(wrong)}, {"errors" + suffix, std::move(errors)}}};
}

Chart deformation_chart(const ChartContext& context, const ChartInput& input,
                        const std::string& suffix) {
    std::vector<Updated> methods;
    std::vector<std::vector<FrameScore>> scores;
    const Effort effort{.chunk_rays = context.effort.chunk_rays, .rounds = 5};
    WorldBounds bounds;
    for (const std::vector<vec3>& frame : input.frames)
        bounds.extend(chart_bounds(input.topology, frame));
    for (const std::vector<vec3>& frame : input.frames) {
        const ChartScene scene = make_chart_scene(input.topology, frame, bounds);
        if (methods.empty()) {
            const auto add = [&](const char* method, std::unique_ptr<UpdatePolicy> policy) {
                methods.push_back(ours(method, input.topology, scene, std::move(policy)));
            };
            add("refit", make_update_policy({.kind = PolicyKind::kRefit}));
            add("restructure", std::make_unique<RestructureAlways>());
            add("rebuild", make_update_policy({.kind = PolicyKind::kRebuild}));
            methods.push_back(of_2007("2007 refit", scene, false));
            methods.push_back(of_2007("2007 rebuild", scene, true));
        }
        std::vector<FrameScore>& one = scores.emplace_back(methods.size());
        for (std::size_t i = 0; i < methods.size(); ++i)
            one[i].update_ms = timed([&] { methods[i].update(scene); });
        const auto tracers = [&](const ChartRays& rays) {
            std::vector<ChartTracer> made;
            for (const Updated& method : methods)
                made.push_back({method.method, method.family, false, method.tracer(rays),
                                rays.scene_space.whole()});
            return made;
        };
        for (std::size_t kind = 0; kind < kFrameKinds.size(); ++kind) {
            const std::vector<ChartPoint> points =
                measure(scene, tracers, kFrameKinds[kind], effort, [] {});
            for (std::size_t i = 0; i < methods.size(); ++i) one[i].scores[kind] = points[i].score;
        }
        context.done();
    }
    Table table = table_with(
        {"kind", "frame", "method", "family", "update [ms]", "frame [ms]", "shown [1/million]"});
    std::vector<std::uint64_t> wrong(methods.size());
    std::uint64_t rays = 0;
    for (std::size_t kind = 0; kind < kFrameKinds.size(); ++kind) {
        // Curves are made of rows that follow each other.
        for (std::size_t k = 0; k < methods.size(); ++k) {
            for (std::size_t i = 0; i < scores.size(); ++i) {
                const FrameScore& one = scores[i][k];
                const Score& score = one.scores[kind];
                wrong[k] += score.wrong();
                if (k == 0) rays += score.rays;
                add_row(
                    table,
                    {name_of(kFrameKinds[kind]), number(input.frame_numbers[i]), methods[k].method,
                     methods[k].family, number(one.update_ms), number(one.ms()), shown_rate(score)},
                    score);
            }
        }
    }
    const auto speed = [&](std::size_t frame, std::size_t method) {
        return number(scores[frame][method].scores[0].mrays_per_second());
    };
    const std::size_t last = scores.size() - 1;
    plot::Figure figure{
        .title = fmt::format(
            "Degrading trees on {} ({} triangles, {} camera rays a frame). Refitted since frame "
            "{}, our tree goes from {} to {} Mray/s, with {} wrong answers of {}; that of 2007 "
            "from {} to {}, with {}. Traces of the method of 2007 have lost more time than a build "
            "takes {}; ours {}",
            input.name, input.topology.triangles.size(), scores[0][0].scores[0].rays,
            number(input.frame_numbers[0]), speed(0, 0), speed(last, 0), wrong[0], count_text(rays),
            speed(0, 3), speed(last, 3), wrong[3], rebuild_text(input.frame_numbers, scores, 3, 4),
            rebuild_text(input.frame_numbers, scores, 0, 2)),
        .footer = context.footer,
        .panel_height = 300,
        .panels = {}};
    const plot::Panel lines{{"kind", "lines"}, {"x", "frame"}, {"xlabel", "frame"}};
    figure.panels.push_back(speed_panel(RayKind::kPrimary, "camera rays", lines));
    plot::Panel& times =
        figure.panels.emplace_back(speed_panel(RayKind::kPrimary, "update and camera rays", lines));
    times.insert_or_assign("y", "frame [ms]");
    times.insert_or_assign("ylabel", "ms");
    times.erase("lower");
    times.erase("upper");
    figure.panels.push_back(
        speed_panel(RayKind::kAimed, "rays at vertices and edges, a point a frame", kAgainstWrong));
    return {
        "deformation" + suffix, std::move(table), {{"deformation" + suffix, std::move(figure)}}};
}

Chart failure_chart(const ChartContext& context, const std::vector<ChartInput>& more) {
    const Effort effort{.chunk_rays = context.effort.failure_rays};
    std::vector<ChartInput> inputs = failure_scenes();
    inputs.insert(inputs.end(), more.begin(), more.end());
    Table table = table_with({"scene", "method", "row", "column", "time [1/ordinary]"});
    struct Column {
        std::string method;
        /// On the scene of this row.
        Score score = {};
        /// The time of a ray on the first scene, and the largest multiple of it.
        double ordinary = 0;
        double slowest = 1;
        std::string slowest_scene = {};
        /// On how many scenes it is wrong.
        std::size_t failures = 0;
    };
    std::vector<Column> columns;
    for (std::size_t row = 0; row < inputs.size(); ++row) {
        const std::string& name = inputs[row].name;
        const ChartScene scene = make_chart_scene(inputs[row]);
        // Fewer columns: no HIGH trees, no tracers for checks, no devices.
        const auto tracers = [methods = chart_methods(scene, {})](const ChartRays& rays) {
            std::vector<ChartTracer> made = methods(rays);
            std::erase_if(made, [](const ChartTracer& one) {
                return one.method.ends_with("HIGH") || one.method == "brute force" ||
                       one.method == "scalar";
            });
            return made;
        };
        for (Column& column : columns) column.score = {};
        for (const RayKind kind : {RayKind::kPrimary, RayKind::kAimed, RayKind::kDiffuse}) {
            for (const ChartPoint& point : measure(scene, tracers, kind, effort, [] {})) {
                auto column = std::ranges::find(columns, point.method, &Column::method);
                if (column == columns.end())
                    column =
                        columns.insert(column, {.method = point.method, .slowest_scene = name});
                column->score += point.score;
            }
        }
        for (std::size_t i = 0; i < columns.size(); ++i) {
            Column& column = columns[i];
            const double time = column.score.ms / static_cast<double>(column.score.rays);
            if (row == 0) column.ordinary = time;
            const double ratio = time / column.ordinary;
            if (ratio > column.slowest) {
                column.slowest = ratio;
                column.slowest_scene = name;
            }
            column.failures += column.score.wrong() > 0;
            add_row(table,
                    {name, column.method, std::to_string(row), std::to_string(i), number(ratio)},
                    column.score);
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
