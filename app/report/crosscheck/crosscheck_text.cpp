#include <fmt/format.h>

#include <algorithm>

#include "app/report/crosscheck/check_report.h"
#include "common/report/shell.h"
#include "common/report/table.h"
#include "common/text/number_text.h"

namespace mray::app {
namespace {

// The text describes so many comparisons, and so many pixels of each.
constexpr std::size_t kShownRows = 8;
constexpr std::size_t kShownPixels = 3;

std::string describe_hit(const Hit& hit, std::uint32_t occlusion, std::uint32_t pixel) {
    const std::string shading =
        fmt::format("occluded {} colour #{:02x}{:02x}{:02x}", occlusion, pixel & 0xFF,
                    (pixel >> 8) & 0xFF, (pixel >> 16) & 0xFF);
    if (hit.prim_id == kNoPrim) return "miss " + shading;
    return fmt::format("t {} u {} v {} prim {} {}", hex_text(hit.t), hex_text(hit.u),
                       hex_text(hit.v), hit.prim_id, shading);
}

template <class Rows>
std::size_t count_differing(const Rows& rows) {
    return static_cast<std::size_t>(
        std::ranges::count_if(rows, [](const auto& row) { return !row.equal(); }));
}

std::string result_of(std::size_t differing, std::size_t all) {
    return differing == 0 ? "equal" : fmt::format("{} of {} differ", differing, all);
}

/// The refitted trees that differ, frame by frame, after a line about all.
std::string compared_trees(const CheckReport& report) {
    if (report.trees.empty()) return "";
    const std::size_t differing = count_differing(report.trees);
    std::string text =
        fmt::format("\ntrees refitted on cpu and on vulkan, {} frame{}: {}\n", report.trees.size(),
                    report.trees.size() == 1 ? "" : "s", result_of(differing, report.trees.size()));
    if (differing == 0) return text;
    Table table({"frame", "tree refitted on cpu", "on vulkan"});
    for (const TreeRow& row : report.trees) {
        if (row.equal()) continue;
        table.add(
            {fmt::format("{}", row.frame), hash_text(row.cpu_hash), hash_text(row.vulkan_hash)});
    }
    return text + table.text();
}

/// The answers that differ, after a line about all.
std::string compared_queries(const CheckReport& report) {
    if (report.queries.empty()) return "";
    std::string text = fmt::format(
        "\nall hits, windings and closest triangles of {} rays and points a frame, {}: {}\n",
        report.queries.front().count, report.queries.size(),
        result_of(count_differing(report.queries), report.queries.size()));
    for (const QueryRow& row : report.queries)
        if (!row.equal()) text += fmt::format("  {}\n", query_text(row));
    return text;
}

std::string title_of(const CheckRow& row) {
    return fmt::format("\nframe {}, {}, {}: {}\n", row.frame, row.variant(), row.rays,
                       describe(row.difference));
}

/// The `morphray probe` that traces one pixel of options.source.scene as the row's variant did, or
/// as its reference. `build_at` is the frame that the refitted tree was built at.
std::string probe_command(const CrosscheckOptions& options, const CheckRow& row,
                          const PixelDifference& pixel, double build_at, bool reference) {
    std::vector<std::string> line = {"morphray", "probe", options.source.scene};
    const auto add = [&line](const char* name, const std::string& value) {
        line.insert(line.end(), {name, value});
    };
    add("--frame", fmt::format("{}", row.frame));
    add("--pixel", fmt::format("{},{}", pixel.x, pixel.y));
    add("--rays", row.rays);
    const std::uint32_t rays = row.rays == "ao"       ? kRaysAo
                               : row.rays == "shadow" ? kRaysShadow
                                                      : kRaysPrimary;
    for (const auto& part : {arguments_of(options.view, rays, false), arguments_of(options.source)})
        line.insert(line.end(), part.begin(), part.end());
    if (options.split != SplitMethod::kBinned) add("--build", "sweep");
    const std::string& backend = reference ? row.reference : row.backend;
    add("--backend", backend);
    if (backend == "cpu") add("--simd", reference || row.simd.empty() ? "off" : row.simd);
    add("--update", reference ? "rebuild" : row.update);
    if (!reference && row.update == "refit") {
        add("--build-at", fmt::format("{}", build_at));
    }
    const std::string& device = options.backend.device;
    const bool on_device = row.backend == "vulkan" || row.refit_on == "vulkan";
    if (!reference && on_device && !device.empty()) add("--device", device);
    return shell_line(line);
}

}  // namespace

std::string CheckRow::variant() const {
    const std::string tracer = backend + (simd.empty() ? "" : " " + simd);
    return tracer + (update == "refit" ? ", refit on " + refit_on : ", rebuild");
}

void compare(const Frame& expected, const Frame& actual, CheckRow& row) {
    row.difference = compare_frames(expected, actual);
    row.expected_hits_hash = hits_hash(expected);
    row.hits_hash = hits_hash(actual);
    row.expected_image_hash = image_hash(expected);
    row.image_hash = image_hash(actual);
}

std::string describe(const QueryDifference& difference) {
    std::string text;
    const auto add = [&text](std::size_t count, const char* kind, const char* in) {
        if (count == 0) return;
        text += fmt::format("{}{} {}{} in {}", text.empty() ? "" : ", ", count, kind,
                            count == 1 ? " differs" : "s differ", in);
    };
    add(difference.all_hits, "ray", "all hits");
    add(difference.winding, "point", "the winding");
    add(difference.closest, "point", "the closest triangle");
    return text;
}

std::size_t CheckReport::differing() const {
    return count_differing(rows) + count_differing(trees) + count_differing(queries);
}

bool CheckRun::complete() const {
    return error.empty() &&
           std::ranges::all_of(scenes, [](const CheckReport& scene) { return scene.complete; });
}

bool CheckRun::equal() const {
    return std::ranges::all_of(scenes, [](const CheckReport& scene) { return scene.equal(); });
}

std::string describe_row(const CrosscheckOptions& options, const CheckRow& row, double build_at) {
    std::string text = title_of(row);
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

std::string query_text(const QueryRow& row) {
    return fmt::format("frame {}, {}, against {}: {}", row.frame, row.variant, row.reference,
                       describe(row.difference));
}

std::string table_text(const CheckReport& report) {
    Table table({"variant", "images", "result", "trace ms"});
    std::vector<std::string> variants;
    for (const CheckRow& row : report.rows)
        if (std::ranges::find(variants, row.variant()) == variants.end())
            variants.push_back(row.variant());
    for (const std::string& variant : variants) {
        std::size_t images = 0;
        std::size_t differing = 0;
        double trace_ms = 0;
        for (const CheckRow& row : report.rows) {
            if (row.variant() != variant) continue;
            ++images;
            differing += row.equal() ? 0 : 1;
            trace_ms += row.trace_ms;
        }
        table.add({variant, fmt::format("{}", images), result_of(differing, images),
                   fmt::format("{:.2f}", trace_ms)});
    }
    return table.text() + compared_trees(report) + compared_queries(report);
}

std::string summary_text(const CheckReport& report) {
    std::string text = report.equal() ? fmt::format("\nall {} comparisons are equal bit by bit\n",
                                                    report.comparisons())
                                      : fmt::format("\n{} of {} comparisons differ\n",
                                                    report.differing(), report.comparisons());
    if (!report.complete) text += fmt::format("not finished: {}\n", report.error);
    return text;
}

std::string run_text(const CrosscheckOptions& options, const CheckRun& run) {
    std::string text;
    CrosscheckOptions one = options;
    for (const CheckReport& report : run.scenes) {
        if (report.comparisons() == 0) continue;
        if (run.scenes.size() > 1)
            text += fmt::format("{}{}\n\n", text.empty() ? "" : "\n", report.spec);
        text += table_text(report);
        one.source.scene = report.spec;
        std::size_t shown = 0;
        for (const CheckRow& row : report.rows) {
            if (row.equal()) continue;
            text += ++shown > kShownRows ? title_of(row)
                                         : describe_row(one, row, report.frames.front());
        }
        text += summary_text(report);
    }
    return text;
}

}  // namespace mray::app
