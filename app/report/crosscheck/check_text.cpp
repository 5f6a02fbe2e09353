#include <fmt/format.h>

#include <algorithm>

#include "app/report/crosscheck/check_report.h"
#include "common/report/table.h"

namespace mray::app {
namespace {

// The text describes so many comparisons of a scene.
constexpr std::size_t kShownRows = 8;

std::string result_of(std::size_t differing, std::size_t all) {
    return differing == 0 ? "equal" : fmt::format("{} of {} differ", differing, all);
}

/// A row for each variant, in the order in which they were first compared.
std::string table_text(const Json& rows) {
    struct Images {
        std::string variant;
        std::size_t all = 0;
        std::size_t differing = 0;
        double trace_ms = 0;
    };
    std::vector<Images> variants;
    for (const Json& row : rows) {
        const std::string variant = row["variant"];
        auto images = std::ranges::find(variants, variant, &Images::variant);
        if (images == variants.end()) images = variants.insert(images, {variant});
        ++images->all;
        images->differing += row["equal"] ? 0 : 1;
        images->trace_ms += row["trace_ms"].get<double>();
    }
    Table table({"variant", "images", "result", "trace ms"});
    for (const Images& images : variants)
        table.add({images.variant, fmt::format("{}", images.all),
                   result_of(images.differing, images.all),
                   fmt::format("{:.2f}", images.trace_ms)});
    return table.text();
}

/// The trees and the answers that differ, each after a line about all.
std::string compared_trees(const Json& trees) {
    if (trees.empty()) return "";
    std::string text =
        fmt::format("\ntrees refitted on cpu and on vulkan, {} frame{}: {}\n", trees.size(),
                    trees.size() == 1 ? "" : "s", result_of(count_differing(trees), trees.size()));
    for (const Json& row : trees) {
        if (row["equal"]) continue;
        text += fmt::format("  frame {}: {} on cpu, {} on vulkan\n", plain_text(row["frame"]),
                            plain_text(row["cpu_bvh_hash"]), plain_text(row["vulkan_bvh_hash"]));
    }
    return text;
}

std::string compared_queries(const Json& queries) {
    if (queries.empty()) return "";
    std::string text = fmt::format(
        "\nall hits, windings and closest triangles of {} rays and points a frame, {}: {}\n",
        plain_text(queries.front()["count"]), queries.size(),
        result_of(count_differing(queries), queries.size()));
    for (const Json& row : queries) {
        if (row["equal"]) continue;
        text += fmt::format("  frame {}, {}, against {}: {}\n", plain_text(row["frame"]),
                            plain_text(row["variant"]), plain_text(row["reference"]),
                            plain_text(row["message"]));
    }
    return text;
}

std::string compared_images(const Json& rows) {
    std::string text;
    std::size_t shown = 0;
    for (const Json& row : rows) {
        if (row["equal"]) continue;
        text += fmt::format("\nframe {}, {}, {}: {}\n", plain_text(row["frame"]),
                            plain_text(row["variant"]), plain_text(row["rays"]),
                            plain_text(row["message"]));
        if (++shown <= kShownRows) text += plain_text(row["details"]);
    }
    return text;
}

}  // namespace

std::string run_text(const Json& report) {
    std::string text;
    for (const Json& scene : report["scenes"]) {
        std::size_t all = 0;
        std::size_t differing = 0;
        for (const char* list : kResults) {
            all += scene[list].size();
            differing += count_differing(scene[list]);
        }
        if (all == 0) continue;
        if (report["scenes"].size() > 1)
            text += fmt::format("{}{}\n\n", text.empty() ? "" : "\n", plain_text(scene["spec"]));
        text += table_text(scene["rows"]) + compared_trees(scene["trees"]) +
                compared_queries(scene["queries"]) + compared_images(scene["rows"]);
        text += differing == 0 ? fmt::format("\nall {} comparisons are equal bit by bit\n", all)
                               : fmt::format("\n{} of {} comparisons differ\n", differing, all);
        if (!scene["complete"])
            text += fmt::format("not finished: {}\n", plain_text(scene["error"]));
    }
    return text;
}

}  // namespace mray::app
