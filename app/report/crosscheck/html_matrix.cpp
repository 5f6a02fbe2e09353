#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "app/report/crosscheck/html_parts.h"
#include "app/report/crosscheck/variants.h"
#include "common/text/number_text.h"
#include "tools/text/xml_text.h"

namespace mray::app {
namespace {

/// Frames and kinds of rays in the order of their first comparison.
struct Columns {
    std::vector<double> frames;
    std::vector<std::string> rays;
};

template <class T>
void add_once(std::vector<T>& values, const T& value) {
    if (std::ranges::find(values, value) == values.end()) values.push_back(value);
}

Columns columns_of(const CheckReport& report) {
    Columns columns;
    for (const CheckRow& row : report.rows) {
        add_once(columns.frames, row.frame);
        add_once(columns.rays, row.rays);
    }
    return columns;
}

std::string head_html(const Columns& columns) {
    std::string html = "<thead><tr><th scope=\"col\" rowspan=\"2\">variant</th>";
    for (const double frame : columns.frames)
        html += fmt::format("<th scope=\"colgroup\" colspan=\"{}\">frame {}</th>",
                            columns.rays.size(), frame);
    html += "</tr>\n<tr>";
    for (std::size_t i = 0; i < columns.frames.size(); ++i)
        for (const std::string& rays : columns.rays)
            html += fmt::format("<th scope=\"col\">{}</th>", xml_escaped(rays));
    return html + "</tr></thead>\n";
}

/// More columns than these are too many for a page or a phone; then frames go downwards.
constexpr std::size_t kMostColumns = 9;

/// `span` is an attribute.
std::string cell_html(bool equal, const std::string& text, const std::string& span = "") {
    return fmt::format("<td class=\"{}\"{}>{}</td>", equal ? "good" : "bad", span, text);
}

/// The cell of a comparison: "equal", or the number of pixels with a link to their description.
std::string row_cell(const ScenePart& scene, const CheckRow& row,
                     const std::set<std::size_t>& shown) {
    if (row.equal()) return cell_html(true, "equal");
    const auto index = static_cast<std::size_t>(&row - scene.report.rows.data());
    const std::string text =
        fmt::format("{} differ{}", row.difference.total(), single_kind(row.difference));
    return cell_html(false, shown.contains(index)
                                ? fmt::format("<a href=\"#{}\">{}</a>", row_id(scene, index), text)
                                : text);
}

/// The cell of an image that was not compared: it may be the reference itself.
std::string missing_cell(const CheckReport& report, const Variant& variant, double frame,
                         const std::string& rays) {
    const bool is_reference =
        variant.name == "cpu, rebuild" &&
        std::ranges::any_of(report.references, [&](const ReferenceImage& image) {
            return image.frame == frame && image.rays == rays && image.reference == "cpu";
        });
    return is_reference ? "<td>the reference</td>" : "<td>not compared</td>";
}

std::string variant_cell(const ScenePart& scene, const Variant& variant, double frame,
                         const std::string& rays, const std::set<std::size_t>& shown) {
    const auto row = std::ranges::find_if(
        variant.rows, [&](const CheckRow* r) { return r->frame == frame && r->rays == rays; });
    return row != variant.rows.end() ? row_cell(scene, **row, shown)
                                     : missing_cell(scene.report, variant, frame, rays);
}

/// The cell of a pair of trees, as wide as all kinds of rays or as high.
std::string tree_cell(const CheckReport& report, const std::string& device, double frame,
                      const std::string& span) {
    const auto row = std::ranges::find_if(
        report.trees, [&](const TreeRow& r) { return r.frame == frame && r.device == device; });
    if (row == report.trees.end()) return fmt::format("<td{}>not compared</td>", span);
    return cell_html(row->equal(),
                     row->equal() ? "equal"
                                  : fmt::format("differ: {}, {}", hash_text(row->cpu_hash),
                                                hash_text(row->vulkan_hash)),
                     span);
}

std::string expected_cell(const CheckReport& report, double frame, const std::string& rays) {
    const auto row = std::ranges::find_if(
        report.expected, [&](const ExpectedRow& r) { return r.frame == frame && r.rays == rays; });
    return row == report.expected.end()
               ? "<td>not compared</td>"
               : cell_html(row->equal(), row->equal() ? "equal" : "differs");
}

std::vector<std::string> tree_devices(const CheckReport& report) {
    std::vector<std::string> devices;
    for (const TreeRow& row : report.trees) add_once(devices, row.device);
    return devices;
}

std::string trees_name(const std::string& device) {
    return "trees refitted on cpu and vulkan" +
           (device.empty() ? "" : fmt::format(" {}", xml_escaped(device)));
}

constexpr const char* kExpectedName = "reference, against the expected hashes";

/// Frames and rays side by side, a row for each variant.
std::string wide_rows(const ScenePart& scene, const Columns& columns,
                      const std::set<std::size_t>& shown) {
    const CheckReport& report = scene.report;
    std::string html = head_html(columns) + "<tbody>\n";
    const auto row = [&](const std::string& name, const auto& cell) {
        html += fmt::format("<tr><th scope=\"row\">{}</th>", name);
        for (const double frame : columns.frames)
            for (const std::string& rays : columns.rays) html += cell(frame, rays);
        html += "</tr>\n";
    };
    for (const Variant& variant : variants_of(report)) {
        row(xml_escaped(variant.name), [&](double frame, const std::string& rays) {
            return variant_cell(scene, variant, frame, rays, shown);
        });
    }
    const std::string span = fmt::format(" colspan=\"{}\"", columns.rays.size());
    for (const std::string& device : tree_devices(report)) {
        row(trees_name(device), [&](double frame, const std::string& rays) {
            return rays == columns.rays.front() ? tree_cell(report, device, frame, span) : "";
        });
    }
    if (!report.expected.empty()) {
        row(kExpectedName, [&](double frame, const std::string& rays) {
            return expected_cell(report, frame, rays);
        });
    }
    return html + "</tbody>";
}

/// Names of the columns of tall_rows() by their numbers.
std::string column_list(const CheckReport& report) {
    std::string html = "<ol class=\"variants\">\n";
    const auto item = [&html](const std::string& name) {
        html += fmt::format("<li>{}</li>\n", name);
    };
    for (const Variant& variant : variants_of(report)) item(xml_escaped(variant.name));
    for (const std::string& device : tree_devices(report)) item(trees_name(device));
    if (!report.expected.empty()) item(kExpectedName);
    return html + "</ol>\n";
}

/// A row for each frame and kind of rays; variants side by side, by their numbers.
std::string tall_rows(const ScenePart& scene, const Columns& columns,
                      const std::set<std::size_t>& shown) {
    const CheckReport& report = scene.report;
    const std::vector<Variant> variants = variants_of(report);
    const std::vector<std::string> devices = tree_devices(report);
    const std::size_t count =
        variants.size() + devices.size() + (report.expected.empty() ? 0u : 1u);
    std::string html = "<thead><tr><th scope=\"col\">frame</th><th scope=\"col\">rays</th>";
    for (std::size_t i = 0; i < count; ++i) html += fmt::format("<th scope=\"col\">{}</th>", i + 1);
    html += "</tr></thead>\n";
    const std::string span = fmt::format(" rowspan=\"{}\"", columns.rays.size());
    for (const double frame : columns.frames) {
        html += "<tbody>";
        for (const std::string& rays : columns.rays) {
            const bool is_first = rays == columns.rays.front();
            html += "<tr>";
            if (is_first) html += fmt::format("<th scope=\"rowgroup\"{}>{}</th>", span, frame);
            html += fmt::format("<th scope=\"row\">{}</th>", xml_escaped(rays));
            for (const Variant& variant : variants)
                html += variant_cell(scene, variant, frame, rays, shown);
            if (is_first) {
                for (const std::string& device : devices)
                    html += tree_cell(report, device, frame, span);
            }
            if (!report.expected.empty()) html += expected_cell(report, frame, rays);
            html += "</tr>\n";
        }
        html += "</tbody>\n";
    }
    return html;
}

}  // namespace

std::string row_id(const ScenePart& scene, std::size_t row) {
    return fmt::format("scene-{}-row-{}", scene.index + 1, row + 1);
}

std::string matrix_html(const ScenePart& scene, const std::set<std::size_t>& shown) {
    const Columns columns = columns_of(scene.report);
    if (columns.frames.empty()) return "<p>Nothing was compared.</p>\n";
    const bool is_tall = columns.frames.size() * columns.rays.size() > kMostColumns;
    return fmt::format(
        "{4}<div class=\"scroll\" role=\"region\" tabindex=\"0\" aria-labelledby=\"scene-{0} "
        "matrix-{0}\">"
        "<table class=\"matrix{2}\"><caption id=\"matrix-{0}\">Images of each variant: equal to "
        "the "
        "reference, or how many pixels differ{3}</caption>\n{1}</table></div>\n",
        scene.index + 1,
        is_tall ? tall_rows(scene, columns, shown) : wide_rows(scene, columns, shown),
        is_tall ? " tall" : "", is_tall ? "; columns are the numbers of the list above" : "",
        is_tall ? column_list(scene.report) : "");
}

}  // namespace mray::app
