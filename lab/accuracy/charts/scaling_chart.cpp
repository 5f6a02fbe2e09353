#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/errors.h"
#include "common/bvh/builder/bvh_builder.h"
#include "lab/accuracy/charts/charts.h"
#include "lab/accuracy/measure/measure.h"
#include "scenes/procedural/procedural.h"
#include "scenes/scene_frames.h"

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

double nanoseconds(double ms, double count) { return ms * 1e6 / count; }

Row measure(const ChartContext& context, SceneFrames& frames, Backend& backend) {
    const Topology& topology = frames.clip().topology();
    const double last = frames.clip().last_frame();
    const auto copy = [](std::span<const vec3> p) { return std::vector<vec3>(p.begin(), p.end()); };
    ViewSpec view;
    view.width = view.height = kSide;
    view.fov = kChartFov;
    const std::vector<vec3> first = copy(frames.positions(last / 2));
    const ImageParams first_params = frames.image_params(view);
    const std::vector<vec3> second = copy(frames.positions(last / 2 + 1));
    const ImageParams second_params = frames.image_params(view);
    Bvh bvh = build_bvh(topology, first);
    backend.set_scene(topology, first, bvh);
    Frame frame;
    bool even = false;
    const std::vector<std::function<void()>> runs{
        [&] { bvh = build_bvh(topology, first); },
        [&] {
            backend.refit(even ? first : second);
            backend.finish();
            even = !even;
        },
        [&] { backend.trace_image(even ? second_params : first_params, frame); }};
    const std::vector<double> times = least_times(runs, context.effort.rounds, context.check);
    return {backend.info().name,  topology.triangles.size(), times[0], times[1], times[2],
            double{kSide} * kSide};
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

plot::Panel panel_of(const char* title, const char* columns, const char* unit) {
    return {.kind = "lines",
            .title = title,
            .x = "triangles",
            .y = columns,
            .series = "backend",
            .xlabel = "triangles, n",
            .ylabel = unit,
            .logx = "10"};
}

/// How each time grows.
std::string exponents_text(const std::vector<Row>& rows) {
    std::string text;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const std::string& backend = rows[i].backend;
        if (i > 0 && rows[i - 1].backend == backend) continue;
        text += fmt::format(" Time on {}: build n^{:.2f}, refit n^{:.2f}, trace n^{:.2f}.", backend,
                            exponent_of(rows, backend, &Row::build_ms),
                            exponent_of(rows, backend, &Row::refit_ms),
                            exponent_of(rows, backend, &Row::trace_ms));
    }
    return text;
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
    const plot::Figure figure{
        .title = fmt::format("Number of triangles: builtin:{}, {}x{} pixels", kScene, kSide, kSide),
        .footer = context.footer,
        .panel_height = 360,
        .panels = {panel_of("build, and refit with its transfer",
                            "\"build ns/tri\" \"refit ns/tri\"", "ns a triangle"),
                   panel_of("trace and shade an image", "\"trace ns/ray\"", "ns a ray")}};
    return {"scaling",
            "Flat lines above mean work in proportion "
            "to the triangles; below, a line "
            "rises by a constant for each factor of ten if time grows with the tree's depth." +
                exponents_text(rows),
            table, figure};
}

}  // namespace mray::accuracy
