#include "app/commands/crosscheck/scene_check.h"

#include <fmt/format.h>

#include <optional>
#include <span>
#include <utility>

#include "app/clip/frames.h"
#include "app/terminal/failure.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/progress.h"

namespace mray::app {
namespace {

/// The kinds of rays that are compared.
std::vector<std::uint32_t> rays_of(const CrosscheckOptions& options) {
    if (options.rays) return {*options.rays};
    return {kRaysPrimary, kRaysShadow, kRaysAo};
}

/// Runs the frames and gathers what the reports need.
class FrameChecks {
public:
    FrameChecks(const CrosscheckOptions& options, SceneFrames& scene,
                const SceneCheckContext& context, CheckReport& report)
        : rays_(rays_of(options)),
          checker_(options, scene, report.frames.front(), *context.backends),
          report_(report) {
        report_.device = checker_.device();
    }

    void check(double frame, Progress& progress) {
        const auto on_image = [&](const std::string& name, bool is_compared) {
            const std::string step = fmt::format("frame {}, {}", frame, name);
            is_compared ? progress.begin(step) : progress.prepare(step);
        };
        const auto on_row = [&](const CheckRow& row) {
            throw_if_interrupted();
            report_.rows.push_back(row);
            progress.update(report_.rows.size());
        };
        const CheckedFrame checked = checker_.check(frame, rays_, on_image, on_row);
        report_.trees.insert(report_.trees.end(), checked.trees.begin(), checked.trees.end());
        report_.queries.insert(report_.queries.end(), checked.queries.begin(),
                               checked.queries.end());
    }

    /// The number of comparisons of a frame.
    std::size_t comparisons() const {
        std::size_t count = 0;
        for (const std::uint32_t rays : rays_) count += checker_.variant_count(rays);
        return count;
    }

private:
    std::vector<std::uint32_t> rays_;
    CrossChecker checker_;
    CheckReport& report_;
};

ExitCode check_frames(FrameChecks& checks, const Messages& messages, CheckReport& report) {
    Progress progress("comparing", report.frames.size() * checks.comparisons(), messages);
    for (std::size_t i = 0; i < report.frames.size(); ++i) {
        try {
            checks.check(report.frames[i], progress);
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::kBadInput || report.rows.empty()) throw;
            messages.error(error);
            report.complete = false;
            report.error = message_of(error);
            return ExitCode::kPartial;
        }
    }
    return ExitCode::kOk;
}

}  // namespace

ExitCode check_scene(const CrosscheckOptions& options, const SceneCheckContext& context,
                     CheckReport& report) {
    SceneFrames scene(open_clip(options.source, context.messages));
    const Clip& clip = scene.clip();
    const Topology& topology = clip.topology();
    report.head = {"crosscheck",          clip.name(),        topology.triangles.size(),
                   topology.vertex_count, options.view.width, options.view.height};
    report.frames = select_frames(options.frames, std::nullopt, clip, DefaultFrames::kFew);
    report.build_at = report.frames.front();
    if (!context.backends)
        context.backends =
            make_checked_backends(options.backend, context.devices, context.messages);
    std::optional<Progress> building(std::in_place, "building the tree", 0, context.messages);
    FrameChecks checks(options, scene, context, report);
    building.reset();
    return check_frames(checks, context.messages, report);
}

}  // namespace mray::app
