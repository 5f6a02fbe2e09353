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

/// The comparisons of a backend and tree.
struct Variant {
    std::string name;
    std::vector<const CheckRow*> rows;

    std::size_t differing() const {
        return static_cast<std::size_t>(
            std::ranges::count_if(rows, [](const CheckRow* row) { return !row->equal(); }));
    }
    double trace_ms() const {
        double sum = 0;
        for (const CheckRow* row : rows) sum += row->trace_ms;
        return sum;
    }
};

/// In the order of their first comparison.
std::vector<Variant> variants_of(const CheckReport& report) {
    std::vector<Variant> variants;
    for (const CheckRow& row : report.rows) {
        const auto found = std::ranges::find(variants, row.variant(), &Variant::name);
        Variant& variant =
            found != variants.end() ? *found : variants.emplace_back(Variant{row.variant(), {}});
        variant.rows.push_back(&row);
    }
    return variants;
}

std::string verdict(std::size_t differing, std::size_t all) {
    return differing == 0 ? "equal" : fmt::format("{} of {} differ", differing, all);
}

/// The images that differ; nothing if there are none.
std::string differing_images(const CheckReport& report) {
    Table table({"frame", "variant", "rays", "reference", "pixels that differ"});
    bool any = false;
    for (const CheckRow& row : report.rows) {
        if (row.equal()) continue;
        any = true;
        table.add({fmt::format("{}", row.frame), row.variant(), row.rays, row.reference,
                   fmt::format("{}", row.difference.total())});
    }
    return any ? fmt::format("\n{}", table.text()) : "";
}

/// The refitted trees that differ, frame by frame, after a line about all.
std::string compared_trees(const CheckReport& report) {
    if (report.trees.empty()) return "";
    const auto differing = static_cast<std::size_t>(
        std::ranges::count_if(report.trees, [](const TreeRow& row) { return !row.equal(); }));
    std::string text =
        fmt::format("\ntrees refitted on cpu and on vulkan, {} frame{}: {}\n", report.trees.size(),
                    report.trees.size() == 1 ? "" : "s", verdict(differing, report.trees.size()));
    if (differing == 0) return text;
    Table table({"frame", "tree refitted on cpu", "on vulkan"});
    for (const TreeRow& row : report.trees) {
        if (row.equal()) continue;
        table.add(
            {fmt::format("{}", row.frame), hash_text(row.cpu_hash), hash_text(row.vulkan_hash)});
    }
    return text + table.text();
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
    Table table({"variant", "images", "result", "trace ms"});
    for (const Variant& variant : variants_of(report)) {
        table.add({variant.name, fmt::format("{}", variant.rows.size()),
                   verdict(variant.differing(), variant.rows.size()),
                   fmt::format("{:.2f}", variant.trace_ms())});
    }
    return table.text() + differing_images(report) + compared_trees(report);
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
