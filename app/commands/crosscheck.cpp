// morphray crosscheck: compares the images of all backends, trees and instruction sets.
#include <fmt/format.h>

#include "app/commands/commands.h"
#include "app/commands/cross_checker.h"
#include "app/files/output_folder.h"
#include "app/frames.h"
#include "app/memory_budget.h"
#include "app/report/crosscheck_text.h"
#include "app/report/junit.h"
#include "app/report/report_json.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/progress.h"
#include "common/base/output_file.h"

namespace mray::app {
namespace {

constexpr std::uint32_t kDefaultSide = 256;
// Comparisons that are described in detail.
constexpr std::size_t kShownRows = 8;

Options with_defaults(Options options) {
    if (!options.size_given) options.view.width = options.view.height = kDefaultSide;
    if (options.out.empty()) options.out = "out/crosscheck";
    return options;
}

/// Runs the frames and gathers what the reports need.
class Crosscheck {
public:
    Crosscheck(const Options& options, SceneFrames& scene, const std::vector<double>& frames,
               const std::filesystem::path& folder, const Messages& messages)
        : options_(options),
          folder_(folder),
          build_at_(options.tree.build_at.value_or(frames.front())),
          with_vulkan_(options.backend.choice != BackendChoice::kCpu),
          rays_(options.rays_given
                    ? std::vector<std::uint32_t>{options.view.rays}
                    : std::vector<std::uint32_t>{kRaysPrimary, kRaysShadow, kRaysAo}),
          checker_(options, scene, frames.front(), with_vulkan_, messages) {
        const Topology& topology = scene.clip().topology();
        report_.head = {"crosscheck",          scene.clip().name(), topology.triangles.size(),
                        topology.vertex_count, options.view.width,  options.view.height};
        report_.device = checker_.device();
    }

    void check(double frame, Progress& progress) {
        const TreeRow trees = checker_.check(
            frame, rays_, [&](const CheckRow& row, const Frame& expected, const Frame& actual) {
                throw_if_interrupted();
                report_.rows.push_back(row);
                if (!row.equal()) keep_difference(row, expected, actual);
                progress.update(report_.rows.size());
            });
        if (with_vulkan_) report_.trees.push_back(trees);
    }

    /// The number of comparisons of a frame.
    std::size_t comparisons() const {
        std::size_t count = 0;
        for (const std::uint32_t rays : rays_) count += checker_.variant_count(rays);
        return count;
    }
    bool finished_any() const { return !report_.rows.empty(); }

    /// Writes the reports. Returns whether all images were equal.
    bool finish(bool complete, const Messages& messages) {
        report_.complete = complete;
        if (!options_.json.empty()) write_report(options_.json, to_json(report_));
        if (!options_.junit.empty()) write_report(options_.junit, to_junit(report_));
        if (!takes_stdout({options_.json, options_.junit})) {
            messages.print(table_text(report_) + differences_ + summary_text(report_));
        }
        return report_.equal();
    }

private:
    void keep_difference(const CheckRow& row, const Frame& expected, const Frame& actual) {
        const std::string tree =
            row.update == "refit" ? fmt::format("refit-{}", row.refit_on) : row.update;
        const std::string simd = row.simd.empty() ? "" : "-" + row.simd;
        const std::string name = fmt::format("frame_{}-{}{}-{}-{}.png", frame_label(row.frame),
                                             row.backend, simd, tree, row.rays);
        write_file(folder_ / name, encode_png(difference_image(expected, actual)));
        if (++different_rows_ <= kShownRows) differences_ += describe_row(options_, row, build_at_);
    }

    const Options& options_;
    std::filesystem::path folder_;
    double build_at_;
    bool with_vulkan_;
    std::vector<std::uint32_t> rays_;
    CrossChecker checker_;
    CheckReport report_;
    std::string differences_;
    std::size_t different_rows_ = 0;
};

}  // namespace

ExitCode run_crosscheck(const Options& given, const Messages& messages) {
    const Options options = with_defaults(given);
    check_reports({options.json, options.junit});
    const OutputFolder folder(options.out);
    SceneFrames scene = open_frames(options, messages);
    const std::vector<double> frames = select_frames(options, scene.clip(), DefaultFrames::kFew);
    warn_of_damage(options, scene.clip(), frames, messages);
    const Topology& topology = scene.clip().topology();
    // Three reference frames and the one that is compared.
    const std::uint64_t pixels = std::uint64_t{options.view.width} * options.view.height;
    require_memory({.triangles = topology.triangles.size(),
                    .vertices = topology.vertex_count,
                    .pixels = pixels,
                    .backends = options.backend.choice == BackendChoice::kCpu ? 4u : 6u,
                    .kept_bytes = 3 * pixels * (sizeof(Hit) + 8)});
    Crosscheck crosscheck(options, scene, frames, folder.path(), messages);

    ExitCode code = ExitCode::kOk;
    Progress progress("comparing", frames.size() * crosscheck.comparisons(),
                      progress_mode(options.quiet));
    for (const double frame : frames) {
        try {
            crosscheck.check(frame, progress);
        } catch (const Error& error) {
            progress.hide();
            if (error.kind() != ErrorKind::kBadInput || !crosscheck.finished_any()) throw;
            messages.error(error);
            code = ExitCode::kPartial;
            break;
        }
    }
    progress.hide();
    const bool equal = crosscheck.finish(code == ExitCode::kOk, messages);
    return equal ? code : ExitCode::kCheckFailed;
}

}  // namespace mray::app
