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

std::string number(double value) { return fmt::format("{:.4g}", value); }

/// Columns that every chart has.
constexpr std::string_view kColumns =
    "rays,judged exactly,wrong,wrong [1/million],wrong lower 95 % [1/million],"
    "wrong upper 95 % [1/million],leaks,false misses,false hits,wrong triangles,close,displaced,"
    "beside,t median [ulp],t 99 % [ulp],t largest [ulp],u 99 % [ulp of 1],u largest [ulp of 1],"
    "v 99 % [ulp of 1],v largest [ulp of 1],speed [Mray/s],speed lower quartile [Mray/s],"
    "speed upper quartile [Mray/s],disturbed";

/// Quartiles further apart than by this factor tell more of the machine than of the method.
constexpr double kDisturbed = 1.5;
bool is_disturbed(const Spread& speed) { return speed.upper > kDisturbed * speed.lower; }

Table table_with(std::vector<std::string> header) {
    for (const std::string_view column : split(kColumns, ',')) header.emplace_back(column);
    return Table(std::move(header));
}

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
    const Spread spread = score.speed();
    for (const double speed : {spread.median, spread.lower, spread.upper})
        row.push_back(number(speed));
    row.emplace_back(is_disturbed(spread) ? "disturbed" : "");
    table.add(std::move(row));
}

/// "4096", "10.5 million".
std::string count_text(std::uint64_t count) {
    if (count < 1'000'000) return std::to_string(count);
    return fmt::format("{:.3g} million", 1e-6 * static_cast<double>(count));
}

double wrong_per_million(const Score& score) {
    return 1e6 * rate_of(score.wrong(), score.rays).value;
}

/// The speed of rays of a kind, by method, with the variables of a panel of its own.
plot::Panel speed_panel(RayKind kind, const char* title, plot::Panel own) {
    const int threads = tbb::this_task_arena::max_concurrency();
    own.insert({{"title", title},
                {"where", "kind"},
                {"is", name_of(kind)},
                {"series", "method"},
                {"family", "family"},
                {"y", "speed [Mray/s]"},
                {"lower", "speed lower quartile [Mray/s]"},
                {"upper", "speed upper quartile [Mray/s]"},
                {"ylabel",
                 fmt::format("Mray/s, {} thread{}: better →", threads, threads == 1 ? "" : "s")}});
    return own;
}

const plot::Panel kAgainstWrong = {{"kind", "points"},
                                   {"x", "wrong [1/million]"},
                                   {"xlower", "wrong lower 95 % [1/million]"},
                                   {"xupper", "wrong upper 95 % [1/million]"},
                                   {"xlabel", "← better: wrong answers per million"},
                                   {"label", "shown as"},
                                   {"front", ""}};

const plot::Panel kAgainstError = {{"kind", "points"},
                                   {"x", "t 99 % [ulp]"},
                                   {"xlower", "t median [ulp]"},
                                   {"xupper", "t largest [ulp]"},
                                   {"xlabel", "← better: error of t [ulp]"},
                                   {"label", "shown as"}};

struct TitledKind {
    RayKind kind;
    const char* title;
};
constexpr TitledKind kKinds[] = {{RayKind::kPrimary, "camera rays"},
                                 {RayKind::kShadow, "shadow rays"},
                                 {RayKind::kAimed, "at vertices and edges"},
                                 {RayKind::kDiffuse, "in any order"}};

/// From the fastest on.
std::vector<ChartPoint> sorted_points(std::vector<ChartPoint> points) {
    std::ranges::stable_sort(points, std::ranges::greater{},
                             [](const ChartPoint& point) { return point.score.speed().median; });
    return points;
}

plot::Panel panel_of(std::vector<ChartPoint> points, const TitledKind& rays, plot::Panel own) {
    std::erase_if(points, [](const ChartPoint& point) { return point.method == "brute force"; });
    const auto [least, most] =
        std::ranges::minmax(points, {}, [](const ChartPoint& point) { return point.score.rays; });
    own["note"] =
        fmt::format("{} to {}", count_text(least.score.rays), count_text(most.score.rays));
    return speed_panel(rays.kind, rays.title, std::move(own));
}

/// The method's name in the first figure, which has the fastest of each family, three others that
/// many know, and what no other method of these rays beats in speed and accuracy. Else "".
std::string shown_as(const ChartPoint& point, const std::vector<ChartPoint>& sorted) {
    const std::string& family = point.family;
    const auto& first = *std::ranges::find(sorted, family, &ChartPoint::family);
    const bool leads = first.method == point.method && family != "rules";
    const auto beats = [&](const ChartPoint& other) {
        return other.score.speed().median > point.score.speed().median &&
               wrong_per_million(other.score) <= wrong_per_million(point.score);
    };
    const std::string& method = point.method;
    if (method == "brute force" || (!leads && method != "single" && method != "rule Woop" &&
                                    method != "rule double" && std::ranges::any_of(sorted, beats)))
        return "";
    if (leads && family.starts_with("Embree")) return family;
    return (in_scene_space(family) ? "morphray " : "") + method;
}

/// "packets (410 Mray/s, 0 of 10.5 million wrong)".
std::string text_of(const ChartPoint& point) {
    return fmt::format("{} ({} Mray/s, {} of {} wrong)", point.method,
                       number(point.score.speed().median), point.score.wrong(),
                       count_text(point.score.rays));
}

}  // namespace

std::string ranking(std::span<const ChartPoint> sorted) {
    const Spread best = sorted.front().score.speed();
    std::string others;
    for (const ChartPoint& point : sorted.subspan(1))
        if (point.score.speed().upper >= best.lower) others += ", " + text_of(point);
    const std::string first = text_of(sorted.front());
    if (is_disturbed(best)) return "not ranked, as disturbed: " + first + others;
    return (others.empty() ? "the fastest is " : "not told apart: ") + first + others;
}

std::string accuracy_title(const std::vector<ChartPoint>& points) {
    std::vector<ChartPoint> sorted = sorted_points(points);
    const auto side = [](const ChartPoint& point) { return in_scene_space(point.family); };
    // The fastest of its side, and the other side.
    std::erase_if(sorted, [&, winner = sorted.front()](const ChartPoint& point) {
        return side(point) == side(winner) && point.method != winner.method;
    });
    if (sorted.size() < 2) return "Speed against wrong answers";
    const auto name = [&](const ChartPoint& point) {
        return side(point) ? "morphray" : shown_as(point, sorted);
    };
    const Score& score = sorted[0].score;
    if (!ranking(sorted).starts_with("the fastest"))
        return fmt::format("Camera rays: {} and {} are not told apart{}", name(sorted[0]),
                           name(sorted[1]), is_disturbed(score.speed()) ? " (disturbed)" : "");
    return fmt::format("Camera rays: {} {:.1f} times as fast as {}, {} of {} wrong",
                       name(sorted[0]), score.speed().median / sorted[1].score.speed().median,
                       name(sorted[1]), score.wrong() == 0 ? "none" : std::to_string(score.wrong()),
                       count_text(score.rays));
}

namespace {

/// The fastest methods without a wrong answer and with some, for rays of a kind.
std::string sentence_of(const std::vector<ChartPoint>& points, const TitledKind& rays) {
    std::vector<ChartPoint> sorted = sorted_points(points);
    const auto wrong = std::ranges::stable_partition(
        sorted, [](const ChartPoint& point) { return point.score.wrong() == 0; });
    const std::span<const ChartPoint> right(sorted.begin(), wrong.begin());
    std::string text = fmt::format("{}: ", rays.title);
    text += right.empty() ? "every method has wrong answers"
                          : "without a wrong answer, " + ranking(right);
    if (!wrong.empty()) text += "; of the others, " + ranking({wrong.begin(), wrong.end()});
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

/// Rays whose speed counts, and rays that are hard to answer.
constexpr std::array kFrameKinds = {RayKind::kPrimary, RayKind::kAimed};

/// What one way to update a tree does in one frame.
struct FrameScore {
    double update_ms = 0;
    std::string step, event;
    /// By kind.
    std::array<Score, kFrameKinds.size()> scores = {};

    /// An update and a trace of camera rays.
    double ms() const { return update_ms + scores[0].ms; }
};

/// A tree that follows the frames, and packets over it.
struct Updated {
    const char* method;
    const char* family;
    /// Brings the tree to the frame, and returns how. This is timed.
    std::function<std::string(const ChartScene& frame)> update;
    std::function<Tracer(const ChartRays& rays)> tracer;
    /// Is told the frame's trace of camera rays.
    std::function<void(const Score&)> done = [](const Score&) {};
    std::vector<FrameScore> frames = {};

    bool is_unsure() const {
        std::size_t disturbed = 0;
        for (const FrameScore& frame : frames) disturbed += is_disturbed(frame.scores[0].speed());
        return 4 * disturbed > frames.size();
    }
    /// "3 of 10.5 million".
    std::string wrong() const {
        Score all;
        for (const FrameScore& frame : frames)
            for (const Score& score : frame.scores) all += score;
        return fmt::format("{} of {}", all.wrong(), count_text(all.rays));
    }
};

/// The topology outlives it.
Updated ours(const char* method, const Topology& topology, const ChartScene& first,
             std::unique_ptr<UpdatePolicy> policy) {
    const auto pose = std::make_shared<Pose>(first.scene_space.positions);
    const std::shared_ptr<Backend> backend = cpu::make_cpu_backend();
    const auto updater = std::make_shared<TreeUpdater>(topology, *pose, *backend, std::move(policy),
                                                       BuildConfig{}, UpdateConfig{}, &first.bvh);
    return {
        method, "ours",
        [pose, backend, updater](const ChartScene& frame) {
            pose->move_to(frame.scene_space.positions);
            return std::string(name_of(updater->update().step));
        },
        [backend](const ChartRays& rays) {
            return our_tracers(backend->host_tree(), best_simd_target(), rays.scene_space).front();
        },
        [updater](const Score& score) {
            updater->frame_done({.ms = score.ms, .rays = score.rays});
        }};
}

Updated of_2007(const char* method, const ChartScene& first, bool rebuilds) {
    const auto tree =
        std::make_shared<PeerTree>(build_peer_tree(first.topology, first.scene_space.positions));
    return {method, "2007",
            [tree, rebuilds](const ChartScene& frame) {
                if (rebuilds) *tree = build_peer_tree(frame.topology, frame.scene_space.positions);
                refit(*tree, frame.topology, frame.world_space.positions);
                return std::string(rebuilds ? "rebuild" : "refit");
            },
            [tree](const ChartRays& rays) { return paper_tracer(*tree, rays.world_space); }};
}

std::vector<Updated> follow_frames(const ChartContext& context, const ChartInput& input) {
    std::vector<Updated> methods;
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
            add("auto", make_update_policy({.kind = PolicyKind::kAuto}));
            methods.push_back(of_2007("2007 refit", scene, false));
            methods.push_back(of_2007("2007 rebuild", scene, true));
        }
        for (Updated& method : methods) {
            FrameScore& one = method.frames.emplace_back();
            one.update_ms = timed([&] { one.step = method.update(scene); });
        }
        const auto tracers = [&](const ChartRays& rays) {
            std::vector<Tracer> made;
            for (const Updated& method : methods) {
                Tracer& tracer = made.emplace_back(method.tracer(rays));
                tracer.name = method.method;
                tracer.group = method.family;
            }
            return made;
        };
        for (std::size_t kind = 0; kind < kFrameKinds.size(); ++kind) {
            const std::vector<ChartPoint> points =
                measure(scene, tracers, kFrameKinds[kind], effort, [] {});
            for (std::size_t i = 0; i < methods.size(); ++i)
                methods[i].frames.back().scores[kind] = points[i].score;
        }
        for (const Updated& method : methods) method.done(method.frames.back().scores[0]);
        context.done();
    }
    return methods;
}

std::vector<plot::Panel> frame_panels() {
    const auto lines = [](RayKind kind, const char* title, plot::Panel own) {
        own.insert({{"kind", "lines"}, {"x", "frame"}, {"xlabel", "frame"}});
        return speed_panel(kind, title, std::move(own));
    };
    return {lines(RayKind::kPrimary, "speed of camera rays: higher is better (~: disturbed)",
                  {{"event", "event"}}),
            lines(RayKind::kPrimary, "time of a frame, update and camera rays: lower is better",
                  {{"y", "frame [ms]"}, {"ylabel", "ms"}, {"lower", ""}}),
            lines(RayKind::kAimed, "wrong answers at vertices and edges: lower is better",
                  {{"y", "wrong [1/million]"}, {"ylabel", "per million"}, {"lower", ""}})};
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
    const std::string on =
        fmt::format("{} ({} triangles)", input.name, input.topology.triangles.size());
    plot::Figure wrong{.details = context.details};
    plot::Figure errors{.title =
                            "Speed against the error of t: 99 % of right answers, from the "
                            "median to the largest",
                        .details = context.details};
    std::vector<std::string> notes = {
        "On " + on +
        fmt::format(
            ". A point is one experiment: the same rays for speed and accuracy. Speed is "
            "the median of chunks of rays, with quartiles; where these are further apart "
            "than by a factor of {}, it is disturbed and not ranked. Wrong answers have 95 % "
            "intervals, which of \"none seen\" end at the upper bound. No method beats those "
            "on the grey line in both. Brute force is in the table alone.",
            kDisturbed)};
    Table table = table_with({"kind", "method", "family", "space", "shown as"});
    for (const TitledKind& rays : kKinds) {
        const std::vector<ChartPoint> points =
            measure(scene, methods, rays.kind, context.effort, context.done);
        notes.push_back(sentence_of(points, rays));
        for (const ChartPoint& point : points) {
            add_row(table,
                    {name_of(rays.kind), point.method, point.family,
                     in_scene_space(point.family) ? "scene" : "world",
                     shown_as(point, sorted_points(points))},
                    point.score);
        }
        if (rays.kind == RayKind::kPrimary) wrong.title = accuracy_title(points);
        wrong.panels.push_back(panel_of(points, rays, kAgainstWrong));
        if (rays.kind != RayKind::kShadow)
            errors.panels.push_back(panel_of(points, rays, kAgainstError));
    }
    wrong.panels[0]["front"] = "front";
    const plot::Figure all{.title = "All methods: Mray/s; wrong per million (~: disturbed)",
                           .details = context.details,
                           .panels = {{{"kind", "map"},
                                       {"series", "method"},
                                       {"across", "kind"},
                                       {"method", "method"},
                                       {"number", "speed [Mray/s]"},
                                       {"shade", "wrong [1/million]"}}}};
    return {"accuracy" + suffix,
            std::move(table),
            {{"speed_accuracy" + suffix, std::move(wrong), std::move(notes)},
             {"accuracy" + suffix,
              all,
              {"On " + on + ". aimed: at vertices and edges; diffuse: in any order."}},
             {"errors" + suffix, std::move(errors), {"On " + on + "."}}}};
}

Chart deformation_chart(const ChartContext& context, const ChartInput& input,
                        const std::string& suffix) {
    std::vector<Updated> methods = follow_frames(context, input);
    Updated &refitted = methods[0], &rebuilt = methods[2], &automatic = methods[3],
            &refit_2007 = methods[4], &rebuild_2007 = methods[5];
    const bool unsure = refitted.is_unsure() || rebuilt.is_unsure() || refit_2007.is_unsure() ||
                        rebuild_2007.is_unsure();
    // Marks the frame by which traces have lost more time than a build takes, and says which it is.
    const auto mark_lost_build = [&](Updated& refits, const Updated& rebuilds) -> std::string {
        double lost = 0;
        for (std::size_t i = 0; i < input.frames.size() && !unsure; ++i) {
            lost += refits.frames[i].scores[0].ms - rebuilds.frames[i].scores[0].ms;
            if (lost <= rebuilds.frames[i].update_ms) continue;
            refits.frames[i].event = "a build lost";
            return "by frame " + number(input.frame_numbers[i]);
        }
        return "in no frame";
    };
    const std::string lost = mark_lost_build(refitted, rebuilt);
    const std::string lost_2007 = mark_lost_build(refit_2007, rebuild_2007);
    std::vector<std::string> remedies;
    for (std::size_t i = 0; i < input.frames.size(); ++i) {
        FrameScore& one = automatic.frames[i];
        if (one.step != "rebuild" && one.step != "swap" && one.step != "restructure") continue;
        one.event = one.step;
        remedies.push_back(fmt::format("{} ({})", number(input.frame_numbers[i]), one.step));
    }
    Table table =
        table_with({"kind", "frame", "method", "family", "update [ms]", "frame [ms]", "event"});
    // Curves are made of rows that follow each other.
    for (std::size_t kind = 0; kind < kFrameKinds.size(); ++kind) {
        for (const Updated& method : methods) {
            for (std::size_t i = 0; i < input.frames.size(); ++i) {
                const FrameScore& one = method.frames[i];
                add_row(table,
                        {name_of(kFrameKinds[kind]), number(input.frame_numbers[i]), method.method,
                         method.family, number(one.update_ms), number(one.ms()), one.event},
                        one.scores[kind]);
            }
        }
    }
    plot::Figure figure{
        .title = unsure ? "Refitted trees: disturbed, so when a rebuild pays is not told"
                        : fmt::format("Refitted trees have lost more than a build takes: 2007 {}, "
                                      "morphray {}",
                                      lost_2007, lost),
        .details = context.details,
        .panels = frame_panels()};
    std::vector<std::string> notes = {
        fmt::format("On {} ({} triangles), {} camera rays a frame. From the frame with \"a build "
                    "lost\" on, rebuilding would have paid. The policy auto did more than refit in "
                    "frames: {}.",
                    input.name, input.topology.triangles.size(), refitted.frames[0].scores[0].rays,
                    remedies.empty() ? "none" : fmt::format("{}", fmt::join(remedies, ", "))),
        fmt::format("Wrong answers: refitted {}, rebuilt {}; of 2007 {} and {}.", refitted.wrong(),
                    rebuilt.wrong(), refit_2007.wrong(), rebuild_2007.wrong())};
    return {"deformation" + suffix,
            std::move(table),
            {{"deformation" + suffix, std::move(figure), std::move(notes)}}};
}

Chart failure_chart(const ChartContext& context, const std::vector<ChartInput>& more) {
    const Effort effort{.chunk_rays = context.effort.failure_rays, .rounds = 3};
    std::vector<ChartInput> inputs = failure_scenes();
    inputs.insert(inputs.end(), more.begin(), more.end());
    Table table = table_with({"scene", "method", "family", "time [1/ordinary]"});
    /// With the score on the scene of this row.
    struct Column : ChartPoint {
        /// The time of a ray on the first scene.
        double ordinary = 0;
        /// On how many scenes it is wrong.
        std::size_t failures = 0;
    };
    std::vector<Column> columns;
    for (std::size_t row = 0; row < inputs.size(); ++row) {
        const std::string& name = inputs[row].name;
        const ChartScene scene = make_chart_scene(inputs[row]);
        // Fewer columns: no HIGH trees, no tracers for checks, no devices.
        const auto tracers = [methods = chart_methods(scene, {})](const ChartRays& rays) {
            std::vector<Tracer> made = methods(rays);
            std::erase_if(made, [](const Tracer& one) {
                return one.name.ends_with("HIGH") || one.name == "brute force" ||
                       one.name == "scalar";
            });
            return made;
        };
        for (Column& column : columns) column.score = {};
        for (const RayKind kind : {RayKind::kPrimary, RayKind::kAimed, RayKind::kDiffuse}) {
            for (const ChartPoint& point : measure(scene, tracers, kind, effort, [] {})) {
                auto column = std::ranges::find(columns, point.method, &Column::method);
                if (column == columns.end())
                    column = columns.insert(column, {{point.method, point.family, {}}});
                column->score += point.score;
            }
        }
        for (Column& column : columns) {
            // Speeds of kinds of rays have no median.
            column.score.mrays = {column.score.mrays_per_second()};
            const double time = column.score.ms / static_cast<double>(column.score.rays);
            if (row == 0) column.ordinary = time;
            column.failures += column.score.wrong() > 0;
            add_row(table, {name, column.method, column.family, number(time / column.ordinary)},
                    column.score);
        }
        context.done();
    }
    std::vector<std::string> failures;
    for (const Column& column : columns)
        failures.push_back(fmt::format("{} on {}", column.method, column.failures));
    return {
        "failures",
        std::move(table),
        {{"failures",
          {.title = "Wrong answers per million (% from 10,000 on), on scenes that break methods",
           .details = context.details,
           .panels = {{{"kind", "map"},
                       {"series", "scene"},
                       {"across", "method"},
                       {"method", "method"},
                       {"shade", "wrong [1/million]"},
                       {"percent", "yes"}}}},
          {fmt::format("Wrong on so many of {} scenes: {}.", inputs.size(),
                       fmt::join(failures, ", "))}}}};
}

}  // namespace mray::lab
