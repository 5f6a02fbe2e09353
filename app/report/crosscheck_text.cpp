#include "app/report/crosscheck_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/process/shell_text.h"
#include "common/text/number_text.h"
#include "common/text/table.h"

namespace mray::app {
namespace {

// Pixels of a comparison that are described.
constexpr std::size_t kShownPixels = 3;

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
    const std::string& backend = reference ? row.reference : row.backend;
    add("--backend", backend);
    if (backend == "cpu") add("--simd", reference || row.simd.empty() ? "off" : row.simd);
    add("--update", reference ? "rebuild" : row.update);
    if (!reference && row.update == "refit") {
        add("--refit-on", row.refit_on);
        add("--build-at", fmt::format("{}", build_at));
    }
    if (!reference && !options.backend.device.empty()) add("--device", options.backend.device);
    return shell_line(line);
}

std::string verdict(const CheckRow& row) {
    return row.equal() ? "equal" : fmt::format("{} differ", row.difference.total());
}

}  // namespace

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

std::string table_text(const CheckReport& report) {
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

std::string summary_text(const CheckReport& report) {
    const auto different = [](const auto& rows) {
        return std::count_if(rows.begin(), rows.end(),
                             [](const auto& row) { return !row.equal(); });
    };
    const std::size_t all = report.rows.size() + report.trees.size();
    const auto wrong = different(report.rows) + different(report.trees);
    if (wrong == 0) return fmt::format("\nall {} comparisons are equal bit by bit\n", all);
    return fmt::format("\n{} of {} comparisons differ\n", wrong, all);
}

}  // namespace mray::app
