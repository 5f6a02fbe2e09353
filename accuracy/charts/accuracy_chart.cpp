#include <fmt/format.h>

#include <cmath>

#include "accuracy/charts/charts.h"
#include "accuracy/measure/measure.h"
#include "common/process/gnuplot.h"

namespace mray::accuracy {
namespace {

constexpr const char* kOurColour = "#1f5fbf";
constexpr const char* kRuleColour = "#c46210";
constexpr const char* kPeerColour = "#2e7d32";

struct Point {
    std::string name;
    Family family;
    double mrays = 0;
    VerdictCounts camera;
    VerdictCounts aimed;
};

const char* name_of(Family family) {
    return family == Family::kOurs ? "ours" : family == Family::kRule ? "rule" : "peer";
}

/// Whether no other method is at least as fast and as accurate, and better in one of the two.
bool on_front(const Point& point, const std::vector<Point>& all, VerdictCounts Point::*counts) {
    const double wrong = (point.*counts).wrong_per_million();
    for (const Point& other : all) {
        const double theirs = (other.*counts).wrong_per_million();
        if (theirs <= wrong && other.mrays >= point.mrays &&
            (theirs < wrong || other.mrays > point.mrays)) {
            return false;
        }
    }
    return true;
}

Table table_of(const std::vector<Point>& points) {
    Table table({"method", "family", "Mray/s", "camera rays", "camera wrong", "camera wrong/M",
                 "camera front", "aimed rays", "aimed wrong", "aimed wrong/M", "aimed front",
                 "leaks", "false misses", "false hits", "wrong triangles", "close", "displaced",
                 "beside", "worst ulps"});
    const auto both = [](const Point& p, Verdict verdict) {
        return fmt::format("{}", p.camera[verdict] + p.aimed[verdict]);
    };
    const auto yes = [](bool value) { return value ? "yes" : "no"; };
    for (const Point& p : points) {
        table.add({p.name, name_of(p.family), fmt::format("{:.4g}", p.mrays),
                   fmt::format("{}", p.camera.rays), fmt::format("{}", p.camera.wrong()),
                   fmt::format("{:.4g}", p.camera.wrong_per_million()),
                   yes(on_front(p, points, &Point::camera)), fmt::format("{}", p.aimed.rays),
                   fmt::format("{}", p.aimed.wrong()),
                   fmt::format("{:.4g}", p.aimed.wrong_per_million()),
                   yes(on_front(p, points, &Point::aimed)), both(p, Verdict::kLeak),
                   both(p, Verdict::kFalseMiss), both(p, Verdict::kFalseHit),
                   both(p, Verdict::kWrongTriangle), both(p, Verdict::kClose),
                   both(p, Verdict::kDisplaced), both(p, Verdict::kBeside),
                   fmt::format("{:.3g}", std::max(p.camera.worst_ulps, p.aimed.worst_ulps))});
    }
    return table;
}

/// One panel; `wrong` and `front` are columns of the table, from 1.
std::string panel(const std::string& title, const std::string& file, int wrong, int front,
                  std::size_t rays) {
    // A logarithmic axis has no place for zero, so it is drawn below a single wrong ray.
    const double one = 1e6 / static_cast<double>(std::max<std::size_t>(1, rays));
    const double zero = std::pow(10, std::floor(std::log10(one)) - 1);
    std::string text = fmt::format(
        "set title {} font ',12'\n"
        "zero = {}\nunset logscale\n"
        "set xlabel 'wrong answers per million rays (one ray: {:.2g})'\nset ylabel 'Mray/s'\n"
        "set xrange [zero / 10.0 : 1e6]\nset logscale xy\n"
        "set xtics autofreq format '10^{{%T}}'\nset xtics add ('none' zero)\n"
        "set arrow 1 from zero, graph 0 to zero, graph 1 nohead lw 2 lc rgb '#888888'\n"
        "set key top right\n",
        gnuplot_quoted(title), zero, one);
    // Names are on the side where they overlap fewest others.
    const auto named = [&](const std::string& condition, const char* colour, const char* place) {
        return fmt::format(
            "'{0}.csv' skip 1 using ({1} ? (${2} > 0 ? ${2} : zero) : NaN):3:(strcol(1)) with "
            "labels {3} font ',9' tc rgb '{4}' noenhanced notitle, ",
            file, condition, wrong, place, colour);
    };
    const auto points = [&](const char* family, const char* colour, const char* name) {
        return fmt::format(
            "'{0}.csv' skip 1 using (strcol(2) eq '{1}' ? (${2} > 0 ? ${2} : zero) : NaN):3 with "
            "points pt 7 ps 0.9 lc rgb '{3}' title '{4}', ",
            file, family, wrong, colour, name);
    };
    const std::string packets = "strcol(2) eq 'ours' && strstrt(strcol(1), 'packets') > 0";
    const std::string others = "strcol(2) eq 'ours' && strstrt(strcol(1), 'packets') == 0";
    const std::string fused = "strcol(2) eq 'rule' && strstrt(strcol(1), 'fma') > 0";
    const std::string plain = "strcol(2) eq 'rule' && strstrt(strcol(1), 'fma') == 0";
    text += "plot " + points("ours", kOurColour, "ours, whole") +
            points("rule", kRuleColour, "rules, one plain traversal") +
            points("peer", kPeerColour, "Embree, single rays") +
            named(packets, kOurColour, "left offset 1,0") +
            named(others, kOurColour, "right offset -1,0") +
            named(plain, kRuleColour, "left rotate by 35 offset 0.5,0.5") +
            named(fused, kRuleColour, "left rotate by -35 offset 0.5,-0.5") +
            named("strcol(2) eq 'peer'", kPeerColour, "left offset 1,0");
    text += fmt::format(
        "'{0}.csv' skip 1 using (strcol({1}) eq 'yes' ? (${2} > 0 ? ${2} : zero) : NaN):3 with "
        "points pt 6 ps 2 lw 2 lc rgb '#d00000' title 'Pareto front'\n",
        file, front, wrong);
    return text;
}

}  // namespace

std::size_t accuracy_steps() { return 4; }

Chart accuracy_chart(const ChartContext& context, const ChartInput& input,
                     const std::string& suffix) {
    const Effort& effort = context.effort;
    const ChartScene scene = make_chart_scene(input.name, input.topology, input.positions, {},
                                              effort.side, effort.aimed_rays);
    const std::vector<Method> methods = all_methods(scene, context.make_vulkan_backend);
    context.step();
    const Judge in_scene_space(scene, scene.scene_space);
    const Judge in_world_space(scene, scene.world_space);
    context.step();
    std::vector<Point> points;
    const std::size_t pixels = scene.scene_space.camera_rays.size();
    std::vector<Hit> hits(pixels);
    std::vector<Hit> aimed(scene.scene_space.aimed_rays.size());
    std::vector<std::function<void()>> runs;
    for (const Method& method : methods) {
        const Judge& judge = method.in_scene_space ? in_scene_space : in_world_space;
        Point& point = points.emplace_back();
        point.name = method.name;
        point.family = method.family;
        trace_camera(method, scene, hits);
        point.camera = judge.camera(hits);
        trace_aimed(method, scene, aimed);
        point.aimed = judge.aimed(aimed);
        runs.emplace_back([&] { trace_camera(method, scene, hits); });
    }
    context.step();
    const std::vector<double> times = least_times(runs, effort.rounds, context.check);
    for (std::size_t i = 0; i < points.size(); ++i)
        points[i].mrays = static_cast<double>(pixels) / (times[i] * 1e3);
    context.step();

    const std::string name = "accuracy" + suffix;
    PlotScript script;
    script.title = fmt::format("Speed against accuracy: {}, {} triangles", input.name,
                               input.topology.triangles.size());
    script.footer = context.footer;
    script.width = 1500;
    script.height = 800;
    script.layout = "1,2";
    script.body = panel(fmt::format("{} pixels of a camera", pixels), name, 6, 7, pixels) +
                  "unset label 1\n" +
                  panel(fmt::format("{} rays at vertices, edges, faces", aimed.size()), name, 10,
                        11, aimed.size());
    return {name,
            "Up is faster (camera rays, all threads), left is more accurate; methods on the grey "
            "line gave no wrong answer. No method is better in both than one with a red ring.",
            table_of(points), script};
}

}  // namespace mray::accuracy
