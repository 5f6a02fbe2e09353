// morphray crosscheck: whether all pictures are one.
#include <fmt/format.h>

#include <algorithm>

#include "app/commands.h"
#include "app/cross_checker.h"
#include "app/interrupt.h"
#include "app/junit.h"
#include "app/memory_budget.h"
#include "app/output_folder.h"
#include "app/progress.h"
#include "app/report_json.h"
#include "app/shell_text.h"
#include "app/table.h"
#include "common/output_file.h"

namespace morphray::app {
namespace {

constexpr std::uint32_t kDefaultSide = 256;
// Pixels of a comparison, and comparisons, that are described at length.
constexpr std::size_t kShownPixels = 3;
constexpr std::size_t kShownRows = 8;

Options with_defaults(Options options) {
    if (!options.size_given) options.view.width = options.view.height = kDefaultSide;
    if (options.out.empty()) options.out = "out/crosscheck";
    return options;
}

std::string describe_hit(const Hit& hit, std::uint32_t occlusion, std::uint32_t pixel) {
    const std::string shading =
        fmt::format("occluded {} colour #{:02x}{:02x}{:02x}", occlusion, pixel & 0xFF,
                    (pixel >> 8) & 0xFF, (pixel >> 16) & 0xFF);
    if (hit.prim_id == kNoPrim) return "miss " + shading;
    return fmt::format("t {:a} u {:a} v {:a} prim {} {}", hit.t, hit.u, hit.v, hit.prim_id,
                       shading);
}

/// The command that traces one pixel as a row did.
std::string probe_command(const Options& options, const CheckRow& row, const PixelDifference& pixel,
                          double build_at, bool reference) {
    std::vector<std::string> line = {"morphray", "probe", options.scene};
    const auto add = [&line](const char* name, const std::string& value) {
        line.insert(line.end(), {name, value});
    };
    add("--frame", fmt::format("{}", row.frame));
    add("--pixel", fmt::format("{},{}", pixel.x, pixel.y));
    add("--size", fmt::format("{}x{}", options.view.width, options.view.height));
    add("--rays", row.rays);
    line.insert(line.end(), options.view_arguments.begin(), options.view_arguments.end());
    if (options.allow_empty) line.push_back("--allow-empty");
    if (options.lenient) line.push_back("--lenient");
    add("--backend", reference ? row.reference : row.backend);
    add("--update", reference ? "rebuild" : row.update);
    if (!reference && row.update == "refit") {
        add("--refit-on", row.refit_on);
        add("--build-at", fmt::format("{}", build_at));
    }
    if (!reference && !options.backend.device.empty()) add("--device", options.backend.device);
    return shell_line(line);
}

std::string describe_row(const Options& options, const CheckRow& row, double build_at) {
    std::string text = fmt::format("\nframe {}, {}, {}: {}\n", row.frame, row.variant(), row.rays,
                                   describe(row.difference));
    const auto& pixels = row.difference.first;
    for (std::size_t i = 0; i < std::min(pixels.size(), kShownPixels); ++i) {
        const PixelDifference& p = pixels[i];
        text += fmt::format("  pixel {},{}\n", p.x, p.y);
        text += fmt::format("    {:<8} {}\n", row.reference,
                            describe_hit(p.expected, p.expected_occlusion, p.expected_pixel));
        text += fmt::format("    {:<8} {}\n", row.backend,
                            describe_hit(p.actual, p.actual_occlusion, p.actual_pixel));
        text += fmt::format("    {}\n    {}\n", probe_command(options, row, p, build_at, true),
                            probe_command(options, row, p, build_at, false));
    }
    return text;
}

std::string verdict(const CheckRow& row) {
    return row.equal() ? "equal" : fmt::format("{} differ", row.difference.total());
}

std::string table_of(const CheckReport& report) {
    Table table({"frame", "variant", "rays", "reference", "result", "trace ms", "hits hash"});
    for (const CheckRow& row : report.rows) {
        table.add({fmt::format("{}", row.frame), row.variant(), row.rays, row.reference,
                   verdict(row), fmt::format("{:.2f}", row.trace_ms), hash_text(row.hits_hash)});
    }
    std::string text = table.text();
    if (!report.trees.empty()) {
        Table trees({"frame", "tree refitted on cpu", "on vulkan", "result"});
        for (const TreeRow& row : report.trees) {
            trees.add({fmt::format("{}", row.frame), hash_text(row.cpu_hash),
                       hash_text(row.vulkan_hash), row.equal() ? "equal" : "differs"});
        }
        text += fmt::format("\n{}", trees.text());
    }
    return text;
}

std::string summary_of(const CheckReport& report) {
    const auto different = [](const auto& rows) {
        return std::count_if(rows.begin(), rows.end(),
                             [](const auto& row) { return !row.equal(); });
    };
    const std::size_t all = report.rows.size() + report.trees.size();
    const auto wrong = different(report.rows) + different(report.trees);
    if (wrong == 0) return fmt::format("\nall {} comparisons are equal bit by bit\n", all);
    return fmt::format("\n{} of {} comparisons differ\n", wrong, all);
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

    /// Comparisons of a frame.
    std::size_t comparisons() const {
        std::size_t count = 0;
        for (const std::uint32_t rays : rays_) count += checker_.variant_count(rays);
        return count;
    }
    bool finished_any() const { return !report_.rows.empty(); }

    /// Writes the reports; returns whether all was equal.
    bool finish(bool complete, const Messages& messages) {
        report_.complete = complete;
        if (!options_.json.empty()) write_report(options_.json, to_json(report_));
        if (!options_.junit.empty()) write_report(options_.junit, to_junit(report_));
        if (!takes_stdout({options_.json, options_.junit})) {
            messages.print(table_of(report_) + differences_ + summary_of(report_));
        }
        return report_.equal();
    }

private:
    void keep_difference(const CheckRow& row, const Frame& expected, const Frame& actual) {
        const std::string tree =
            row.update == "refit" ? fmt::format("refit-{}", row.refit_on) : row.update;
        const std::string name = fmt::format("frame_{}-{}-{}-{}.png", frame_label(row.frame),
                                             row.backend, tree, row.rays);
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
    const Topology& topology = scene.clip().topology();
    // Three reference frames besides the one that is compared.
    const std::uint64_t pixels = std::uint64_t{options.view.width} * options.view.height;
    require_memory({.triangles = topology.triangles.size(),
                    .vertices = topology.vertex_count,
                    .pixels = pixels,
                    .backends = options.backend.choice == BackendChoice::kCpu ? 3u : 5u,
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
            if (error.code() != ExitCode::kBadInput || !crosscheck.finished_any()) throw;
            messages.error(error.what());
            code = ExitCode::kPartial;
            break;
        }
    }
    progress.hide();
    const bool equal = crosscheck.finish(code == ExitCode::kOk, messages);
    return equal ? code : ExitCode::kCheckFailed;
}

}  // namespace morphray::app
