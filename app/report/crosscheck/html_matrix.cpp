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

std::string cell_html(bool equal, const std::string& text, std::size_t span = 1) {
    return fmt::format("<td class=\"{}\"{}>{}</td>", equal ? "good" : "bad",
                       span == 1 ? "" : fmt::format(" colspan=\"{}\"", span), text);
}

/// The cell of a comparison: "equal", or the number of pixels with a link to their description.
std::string row_cell(const ScenePart& scene, const CheckRow& row,
                     const std::set<std::size_t>& shown) {
    if (row.equal()) return cell_html(true, "equal");
    const auto index = static_cast<std::size_t>(&row - scene.report.rows.data());
    const std::string text = fmt::format("{} differ", row.difference.total());
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

std::string variant_html(const ScenePart& scene, const Variant& variant, const Columns& columns,
                         const std::set<std::size_t>& shown) {
    std::string html = fmt::format("<tr><th scope=\"row\">{}</th>", xml_escaped(variant.name));
    for (const double frame : columns.frames) {
        for (const std::string& rays : columns.rays) {
            const auto row = std::ranges::find_if(variant.rows, [&](const CheckRow* r) {
                return r->frame == frame && r->rays == rays;
            });
            html += row != variant.rows.end() ? row_cell(scene, **row, shown)
                                              : missing_cell(scene.report, variant, frame, rays);
        }
    }
    return html + "</tr>\n";
}

/// A row for each device, a cell for each frame.
std::string trees_html(const CheckReport& report, const Columns& columns) {
    std::vector<std::string> devices;
    for (const TreeRow& row : report.trees) add_once(devices, row.device);
    std::string html;
    for (const std::string& device : devices) {
        html += fmt::format("<tr><th scope=\"row\">trees refitted on cpu and vulkan{}</th>",
                            device.empty() ? "" : fmt::format(" {}", xml_escaped(device)));
        for (const double frame : columns.frames) {
            const auto row = std::ranges::find_if(report.trees, [&](const TreeRow& r) {
                return r.frame == frame && r.device == device;
            });
            if (row == report.trees.end()) {
                html += fmt::format("<td colspan=\"{}\">not compared</td>", columns.rays.size());
            } else {
                html +=
                    cell_html(row->equal(),
                              row->equal() ? "equal"
                                           : fmt::format("differ: {}, {}", hash_text(row->cpu_hash),
                                                         hash_text(row->vulkan_hash)),
                              columns.rays.size());
            }
        }
        html += "</tr>\n";
    }
    return html;
}

std::string expected_html(const CheckReport& report, const Columns& columns) {
    if (report.expected.empty()) return "";
    std::string html = "<tr><th scope=\"row\">reference, against the expected hashes</th>";
    for (const double frame : columns.frames) {
        for (const std::string& rays : columns.rays) {
            const auto row = std::ranges::find_if(report.expected, [&](const ExpectedRow& r) {
                return r.frame == frame && r.rays == rays;
            });
            html += row == report.expected.end()
                        ? "<td>not compared</td>"
                        : cell_html(row->equal(), row->equal() ? "equal" : "differs");
        }
    }
    return html + "</tr>\n";
}

}  // namespace

std::string row_id(const ScenePart& scene, std::size_t row) {
    return fmt::format("scene-{}-row-{}", scene.index + 1, row + 1);
}

std::string matrix_html(const ScenePart& scene, const std::set<std::size_t>& shown) {
    const Columns columns = columns_of(scene.report);
    if (columns.frames.empty()) return "<p>Nothing was compared.</p>\n";
    std::string html = fmt::format(
        "<div class=\"scroll\" role=\"region\" tabindex=\"0\" aria-labelledby=\"scene-{0} "
        "matrix-{0}\">"
        "<table class=\"matrix\"><caption id=\"matrix-{0}\">Images of each variant: equal to the "
        "reference, or how many pixels differ</caption>\n{1}<tbody>\n",
        scene.index + 1, head_html(columns));
    for (const Variant& variant : variants_of(scene.report))
        html += variant_html(scene, variant, columns, shown);
    html += trees_html(scene.report, columns) + expected_html(scene.report, columns);
    return html + "</tbody></table></div>\n";
}

}  // namespace mray::app
