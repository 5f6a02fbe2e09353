#include "app/commands/profile/profile_driver.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/backends/backends.h"
#include "app/base/memory_budget.h"
#include "app/clip/frames.h"
#include "app/commands/profile/profile_head.h"
#include "app/commands/profile/shown_rows.h"
#include "app/report/json_parts.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/progress.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/surface.h"
#include "common/scene/camera_setup.h"
#include "common/scene/mesh.h"
#include "tools/measure/median.h"
#include "tools/text/table.h"

namespace mray::app {
namespace {

/// A stage of a frame: milliseconds of the driver and of ours.
struct DriverRow {
    double frame;
    std::string stage;
    std::uint64_t rays;
    double driver_ms;
    double ours_ms;
};

/// Secondary rays of the surfaces that camera rays hit, as our backends make them.
struct SecondaryRays {
    std::vector<Ray> shadow;
    std::vector<Ray> ao;
};

SecondaryRays secondary_rays(const ImageParams& params, const Topology& topology,
                             std::span<const vec3> positions, std::span<const Ray> rays,
                             std::span<const Hit> hits) {
    SecondaryRays made;
    for (std::uint32_t i = 0; i < hits.size(); ++i) {
        if (hits[i].prim_id == kNoPrim) continue;
        const uvec3 t = topology.triangles[hits[i].prim_id];
        const Surface surface =
            surface_at(rays[i], hits[i], positions[t.x], positions[t.y], positions[t.z]);
        if (faces_light(surface, params.light))
            made.shadow.push_back(shadow_ray(surface, params.light));
        for (std::uint32_t n = 0; n < params.ao_count; ++n)
            made.ao.push_back(
                ao_ray(surface, i % params.width, i / params.width, n, params.ao_tfar));
    }
    return made;
}

class DriverProfiler {
public:
    DriverProfiler(const Options& options, SceneFrames& scene, double first_frame,
                   const Messages& messages)
        : options_(options),
          topology_(scene.clip().topology()),
          params_(image_params(options, scene)),
          rays_(camera_rays(params_)),
          driver_(make_driver_rays(options.backend.device, options.backend)),
          ours_(make_backend(BackendChoice::kVulkan, options.backend, messages)) {
        const std::span<const vec3> positions = scene.positions(first_frame);
        before_.assign(positions.begin(), positions.end());
    }

    const std::string& driver() const { return driver_->description(); }

    /// Calls `add` with the row of each stage when it is measured.
    void measure(double frame, std::span<const vec3> positions,
                 const std::function<void(const DriverRow&)>& add) {
        const auto row = [&](const char* stage, std::size_t rays, double driver_ms,
                             double ours_ms) {
            add({frame, stage, rays, driver_ms, ours_ms});
        };
        const auto build = [&] {
            driver_->set_scene(topology_, positions);
            return driver_->times().build_ms;
        };
        row("build", 0, median_of(build), 0);
        driver_->set_scene(topology_, before_);
        const auto update = [&] {
            driver_->update(before_);
            driver_->update(positions);
            return driver_->times().build_ms;
        };
        const Bvh tree = build_bvh(topology_, before_, build_config(options_));
        ours_->set_scene(topology_, before_, tree);
        const auto refit = [&] {
            ours_->refit(positions, RefitExtent::kAll);
            return ours_->finish().update.refit_ms;
        };
        row("update", 0, median_of(update), median_of(refit));
        const auto rebuild = [&] {
            driver_->rebuild(positions);
            return driver_->times().build_ms;
        };
        row("rebuild", 0, median_of(rebuild), 0);
        ours_->set_frame(positions, build_bvh(topology_, positions, build_config(options_)));
        measure_rays(positions, row);
        before_.assign(positions.begin(), positions.end());
    }

private:
    template <class Row>
    void measure_rays(std::span<const vec3> positions, const Row& row) {
        std::vector<Hit> hits(rays_.size());
        ours_->trace_rays(rays_, hits);
        const SecondaryRays secondary = secondary_rays(params_, topology_, positions, rays_, hits);
        const auto closest = [&] {
            driver_->intersect(rays_, hits);
            return driver_->times().trace_ms;
        };
        const auto any = [&](const std::vector<Ray>& rays) {
            return [this, &rays] {
                std::vector<std::uint8_t> occluded(rays.size());
                driver_->occluded(rays, occluded);
                return driver_->times().trace_ms;
            };
        };
        const auto single = [&] {
            ours_->trace_rays(rays_, hits);
            return ours_->finish().trace_ms;
        };
        const auto image = [&](std::uint32_t kind) {
            return [this, kind] {
                ImageParams params = params_;
                params.rays = kind;
                ours_->trace_image(params, frame_);
                const BackendTimes& times = ours_->finish();
                return kind == kRaysPrimary ? times.trace_ms - times.shade_ms : times.secondary_ms;
            };
        };
        const double closest_ms = median_of(closest);
        row("camera rays, packets", rays_.size(), closest_ms, median_of(image(kRaysPrimary)));
        row("camera rays, single", rays_.size(), closest_ms, median_of(single));
        row("shadow rays", secondary.shadow.size(), median_of(any(secondary.shadow)),
            median_of(image(kRaysShadow)));
        row("ambient occlusion", secondary.ao.size(), median_of(any(secondary.ao)),
            median_of(image(kRaysAo)));
    }

    /// After a run to warm up.
    double median_of(const std::function<double()>& stage_ms) const {
        std::vector<double> ms;
        stage_ms();
        for (int i = 0; i < options_.repeat; ++i) {
            throw_if_interrupted();
            ms.push_back(stage_ms());
        }
        return median(ms);
    }

    const Options& options_;
    const Topology& topology_;
    ImageParams params_;
    std::vector<Ray> rays_;
    std::unique_ptr<DriverRays> driver_;
    std::unique_ptr<Backend> ours_;
    std::vector<vec3> before_;
    Frame frame_;
};

std::vector<Column> columns_of(const std::vector<double>& frames) {
    std::size_t frame_width = 0;
    for (const double frame : frames)
        frame_width = std::max(frame_width, fmt::format("{}", frame).size());
    return {{"frame", frame_width}, {"stage", 20, false}, {"rays", 8},      {"ray-query ms"},
            {"Mray/s", 7},          {"ours ms"},          {"times as fast"}};
}

std::vector<std::string> cells_of(const DriverRow& row) {
    const auto rate = [&](double ms) {
        return row.rays == 0 || ms <= 0
                   ? std::string("-")
                   : fmt::format("{:.1f}", static_cast<double>(row.rays) / (1e3 * ms));
    };
    const bool has_ours = row.ours_ms > 0;
    return {fmt::format("{}", row.frame),
            row.stage,
            fmt::format("{}", row.rays),
            fmt::format("{:.2f}", row.driver_ms),
            rate(row.driver_ms),
            has_ours ? fmt::format("{:.2f}", row.ours_ms) : "-",
            has_ours ? fmt::format("{:.2f}", row.driver_ms / row.ours_ms) : "-"};
}

std::string csv_of(const std::vector<Column>& columns, const std::vector<DriverRow>& rows) {
    std::vector<std::string> header;
    for (const Column& column : columns) header.push_back(column.name);
    Table table(header);
    for (const DriverRow& row : rows) table.add(cells_of(row));
    return table.csv();
}

std::string json_of(const Options& options, const Clip& clip, const std::string& driver,
                    const std::vector<DriverRow>& rows) {
    Json json = head_of(profile_head(options, clip));
    json["backend"] = "ray-query";
    json["driver"] = driver;
    json["repeat"] = options.repeat;
    json["rows"] = Json::array();
    for (const DriverRow& row : rows)
        json["rows"].push_back({{"frame", row.frame},
                                {"stage", row.stage},
                                {"rays", row.rays},
                                {"driver_ms", row.driver_ms},
                                {"ours_ms", row.ours_ms}});
    return json_text(json);
}

}  // namespace

ExitCode profile_driver(const Options& options, const Messages& messages) {
    check_reports({options.json, options.csv});
    SceneFrames scene = open_frames(options, messages);
    const std::vector<double> frames = select_frames(options, scene.clip(), DefaultFrames::kFew);
    warn_of_damage(options, scene.clip(), frames, messages);
    // Rays and answers of camera, shadows and ambient occlusion are held at once.
    const std::uint64_t pixels = std::uint64_t{options.view.width} * options.view.height;
    require_memory({.triangles = scene.clip().topology().triangles.size(),
                    .vertices = scene.clip().topology().vertex_count,
                    .copies = 4,
                    .pixels = pixels,
                    .devices = 2,
                    .kept_bytes = pixels * (2 + options.view.ao_count) * (sizeof(Ray) + 1)},
                   options.scene);
    DriverProfiler profiler(options, scene, frames.front(), messages);
    const std::vector<Column> columns = columns_of(frames);
    ShownRows shown(fmt::format("driver: {}\n{}", profiler.driver(), header_text(columns)),
                    !takes_stdout({options.json, options.csv}), messages);
    std::vector<DriverRow> rows;
    const auto add = [&](const DriverRow& row) {
        rows.push_back(row);
        shown.add(row_text(columns, cells_of(row)));
    };
    const auto tell = [&](std::size_t done) {
        tell_results(fmt::format("{} of {} frames are measured, and no report is written", done,
                                 frames.size()),
                     {});
    };
    tell(0);
    Progress progress("measuring", "frame", frames.size(), progress_mode(options));
    for (std::size_t i = 0; i < frames.size(); ++i) {
        progress.begin(fmt::format("frame {}", frames[i]), StepPart::kShown);
        profiler.measure(frames[i], scene.positions(frames[i]), add);
        tell(i + 1);
        progress.update(i + 1);
    }
    progress.finish();
    if (!options.json.empty())
        write_report(options.json, json_of(options, scene.clip(), profiler.driver(), rows));
    if (!options.csv.empty()) write_report(options.csv, csv_of(columns, rows));
    shown.finish();
    return ExitCode::kOk;
}

}  // namespace mray::app
