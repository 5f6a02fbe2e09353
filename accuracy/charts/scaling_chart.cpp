#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "accuracy/charts/charts.h"
#include "accuracy/measure/measure.h"
#include "common/base/errors.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/scene/procedural/procedural.h"
#include "common/scene/scene_frames.h"

namespace mray::accuracy {
namespace {

constexpr const char* kScene = "cloth";
constexpr std::uint32_t kSide = 512;

struct Row {
    std::string backend;
    std::uint64_t triangles;
    double build_ms;
    double refit_ms;
    double trace_ms;
    double rays;
};

/// A column of the table, from 1, in the rows of one backend.
struct Line {
    int column;
    std::string what;
    std::string backend;
    /// How the time grows with the triangles.
    double exponent;
};

double nanoseconds(double ms, double count) { return ms * 1e6 / count; }

Row measure(const ChartContext& context, SceneFrames& frames, Backend& backend) {
    const Topology& topology = frames.clip().topology();
    const double last = frames.clip().last_frame();
    const auto copy = [](std::span<const vec3> p) { return std::vector<vec3>(p.begin(), p.end()); };
    const std::vector<vec3> first = copy(frames.positions(last / 2));
    const std::vector<vec3> second = copy(frames.positions(last / 2 + 1));
    ViewSpec view;
    view.width = view.height = kSide;
    view.fov = kChartFov;
    const ImageParams params = make_image_params(view, frames.clip().bounds(), frames.space());
    Bvh bvh = build_bvh(topology, first);
    backend.set_scene(topology, first, bvh);
    Frame frame;
    bool even = false;
    const std::vector<std::function<void()>> runs{[&] { bvh = build_bvh(topology, first); },
                                                  [&] {
                                                      backend.refit(even ? first : second);
                                                      backend.times();
                                                      even = !even;
                                                  },
                                                  [&] { backend.trace_image(params, frame); }};
    const std::vector<double> times = least_times(runs, context.effort.rounds, context.check);
    return {backend.name(), topology.triangles.size(), times[0], times[1],
            times[2],       double{kSide} * kSide};
}

/// The exponent p of time ~ triangles^p that fits best (least squares of logarithms).
double exponent_of(const std::vector<Row>& rows, const std::string& backend, double Row::*time_ms) {
    double count = 0, sum_x = 0, sum_y = 0, sum_xx = 0, sum_xy = 0;
    for (const Row& row : rows) {
        if (row.backend != backend) continue;
        const double x = std::log(static_cast<double>(row.triangles));
        const double y = std::log(row.*time_ms);
        count += 1;
        sum_x += x;
        sum_y += y;
        sum_xx += x * x;
        sum_xy += x * y;
    }
    const double spread = count * sum_xx - sum_x * sum_x;
    return spread > 0 ? (count * sum_xy - sum_x * sum_y) / spread : 0;
}

std::string panel(const std::string& file, const char* title, const char* y,
                  const std::vector<Line>& lines) {
    std::string text = fmt::format(
        "set title '{}' font ',12'\nset logscale xy\nset xlabel 'triangles'\nset ylabel '{}'\n"
        "set xtics autofreq format '10^{{%T}}'\nset key top right noenhanced\nplot ",
        title, y);
    int colour = 1;
    for (const Line& line : lines) {
        text += fmt::format(
            "{0}'{1}.csv' skip 1 using (strcol(1) eq '{2}' ? $2 : NaN):{3} with linespoints pt 7 "
            "lw 2 lc {4} title '{5}, {2}: time ~ n^{6:.2f}'",
            colour == 1 ? "" : ", ", file, line.backend, line.column, colour, line.what,
            line.exponent);
        ++colour;
    }
    return text + "\n";
}

}  // namespace

std::size_t scaling_steps(const Effort& effort) { return effort.triangle_counts.size(); }

Chart scaling_chart(const ChartContext& context) {
    std::vector<Row> rows;
    for (const std::uint64_t count : context.effort.triangle_counts) {
        SceneFrames frames(make_procedural(kScene, count));
        for (const MakeBackend& make : {context.make_cpu_backend, context.make_vulkan_backend}) {
            try {
                const std::unique_ptr<Backend> backend = make();
                rows.push_back(measure(context, frames, *backend));
            } catch (const Error& error) {
                if (error.kind() != ErrorKind::kUnavailable) throw;
            }
        }
        context.step();
    }
    // The points of a line must be adjacent.
    std::stable_sort(rows.begin(), rows.end(),
                     [](const Row& a, const Row& b) { return a.backend < b.backend; });
    Table table(
        {"backend", "triangles", "build ns/tri", "refit ns/tri", "trace ns/tri", "trace ns/ray"});
    for (const Row& row : rows) {
        const auto n = static_cast<double>(row.triangles);
        table.add({row.backend, fmt::format("{}", row.triangles),
                   fmt::format("{:.4g}", nanoseconds(row.build_ms, n)),
                   fmt::format("{:.4g}", nanoseconds(row.refit_ms, n)),
                   fmt::format("{:.4g}", nanoseconds(row.trace_ms, n)),
                   fmt::format("{:.4g}", nanoseconds(row.trace_ms, row.rays))});
    }
    const std::string name = "scaling";
    PlotScript script;
    script.title =
        fmt::format("Number of triangles: builtin:{}, {}x{} pixels", kScene, kSide, kSide);
    script.footer = context.footer;
    script.width = 1400;
    script.layout = "1,2";
    const auto line = [&rows](int column, const char* what, const std::string& backend,
                              double Row::*time_ms) {
        return Line{column, what, backend, exponent_of(rows, backend, time_ms)};
    };
    std::vector<Line> updates{line(3, "build", "cpu", &Row::build_ms),
                              line(4, "refit", "cpu", &Row::refit_ms)};
    std::vector<Line> traces{line(6, "trace", "cpu", &Row::trace_ms)};
    if (rows.back().backend != "cpu") {
        updates.push_back(line(4, "refit", rows.back().backend, &Row::refit_ms));
        traces.push_back(line(6, "trace", rows.back().backend, &Row::trace_ms));
    }
    script.body = panel(name, "build, and refit with its transfer", "ns a triangle", updates) +
                  "unset label 1\n" + panel(name, "trace and shade an image", "ns a ray", traces);
    return {name,
            "Flat lines on the left mean work in proportion to the triangles; on the right a line "
            "rises by a constant for each factor of ten if time grows with the tree's depth.",
            table, script};
}

}  // namespace mray::accuracy
