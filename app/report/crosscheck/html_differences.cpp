#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "app/report/crosscheck/html_parts.h"
#include "app/report/crosscheck/probe_command.h"
#include "common/text/base64.h"
#include "common/text/number_text.h"
#include "tools/text/xml_text.h"

namespace mray::app {
namespace {

std::string kinds_html(const FrameDifference& difference) {
    std::string html = "<ul class=\"kinds\">";
    for (const DifferenceKind& kind : difference_kinds()) {
        const std::uint64_t count = difference.*kind.count;
        if (count == 0) continue;
        html += fmt::format(
            "<li><span class=\"swatch\" style=\"background:#{:02x}{:02x}{:02x}\"></span>{} {}</li>",
            kind.colour & 0xFF, (kind.colour >> 8) & 0xFF, (kind.colour >> 16) & 0xFF, count,
            count == 1 ? kind.one : kind.several);
    }
    return html + "</ul>\n";
}

/// How many floats lie between two finite ones, with the sign of b - a.
std::int64_t steps_between(float a, float b) {
    const auto place = [](float x) {
        const auto bits = std::bit_cast<std::int32_t>(x);
        return std::int64_t{bits < 0 ? std::numeric_limits<std::int32_t>::min() - bits : bits};
    };
    return place(b) - place(a);
}

/// Values that are nearly equal look so in hexadecimal digits, too.
std::string steps_text(float expected, float actual) {
    if (expected == actual || !std::isfinite(expected) || !std::isfinite(actual)) return "";
    return fmt::format(" <small>{:+} ulp</small>", steps_between(expected, actual));
}

struct PixelValues {
    std::string prim, t, u, v, occluded, colour;
};

PixelValues values_of(const Hit& hit, std::uint32_t occlusion, std::uint32_t pixel) {
    const std::string occluded = fmt::format("{}", occlusion);
    const std::string colour =
        fmt::format("#{:02x}{:02x}{:02x}", pixel & 0xFF, (pixel >> 8) & 0xFF, (pixel >> 16) & 0xFF);
    if (hit.prim_id == kNoPrim) return {"miss", "none", "none", "none", occluded, colour};
    return {fmt::format("{}", hit.prim_id),
            hex_text(hit.t),
            hex_text(hit.u),
            hex_text(hit.v),
            occluded,
            colour};
}

/// The values of one image, those that differ from the other image's marked.
/// `notes` follow t, u and v.
std::string values_html(const PixelValues& values, const PixelValues& others,
                        const PixelValues& notes = {}) {
    std::string html;
    for (const auto member : {&PixelValues::prim, &PixelValues::t, &PixelValues::u, &PixelValues::v,
                              &PixelValues::occluded, &PixelValues::colour}) {
        const std::string& value = values.*member;
        html += value == others.*member
                    ? fmt::format("<td>{}</td>", value)
                    : fmt::format("<td><mark>{}</mark>{}</td>", value, notes.*member);
    }
    return html;
}

std::string pixels_html(const std::string& id, const CheckRow& row) {
    std::string html = fmt::format(
        "<div class=\"scroll\" role=\"group\" tabindex=\"0\" aria-labelledby=\"{0} {0}-values\">"
        "<table class=\"values\"><caption id=\"{0}-values\">The first pixels that differ; values "
        "that differ are marked</caption>\n<thead><tr><th scope=\"col\">pixel</th><th "
        "scope=\"col\">image of</th><th scope=\"col\">prim</th><th scope=\"col\">t</th><th "
        "scope=\"col\">u</th><th scope=\"col\">v</th><th scope=\"col\">occluded</th><th "
        "scope=\"col\">colour</th></tr></thead>\n",
        id);
    const auto& pixels = row.difference.first;
    for (std::size_t i = 0; i < std::min(pixels.size(), kShownPixels); ++i) {
        const PixelDifference& p = pixels[i];
        const PixelValues expected = values_of(p.expected, p.expected_occlusion, p.expected_pixel);
        const PixelValues actual = values_of(p.actual, p.actual_occlusion, p.actual_pixel);
        PixelValues steps;
        if (p.expected.prim_id != kNoPrim && p.actual.prim_id != kNoPrim) {
            steps.t = steps_text(p.expected.t, p.actual.t);
            steps.u = steps_text(p.expected.u, p.actual.u);
            steps.v = steps_text(p.expected.v, p.actual.v);
        }
        html += fmt::format(
            "<tbody><tr><th scope=\"rowgroup\" rowspan=\"2\">{},{}</th><th scope=\"row\">reference "
            "({})</th>{}</tr>\n<tr><th scope=\"row\">variant</th>{}</tr></tbody>\n",
            p.x, p.y, xml_escaped(row.reference), values_html(expected, actual),
            values_html(actual, expected, steps));
    }
    return html + "</table></div>\n";
}

std::string command_html(const std::string& id, const char* of, const std::string& command) {
    return fmt::format(
        "<div class=\"command\"><code id=\"{0}\">{1}</code><button type=\"button\" hidden "
        "data-copy=\"{0}\" aria-describedby=\"{0}-of\">Copy</button><span class=\"note\" "
        "id=\"{0}-of\">traces the pixel as the {2}</span></div>\n",
        id, xml_escaped(command), of);
}

std::string commands_html(const ScenePart& scene, const std::string& id, const CheckRow& row) {
    if (row.difference.first.empty()) return "";
    const PixelDifference& pixel = row.difference.first.front();
    const auto command = [&](bool reference) {
        return probe_command(scene.options, row, pixel, scene.report.build_at, reference);
    };
    return command_html(id + "-a", "reference", command(true)) +
           command_html(id + "-b", "variant", command(false));
}

std::string image_html(const char* kind, const std::vector<std::byte>& png, const RowImages& images,
                       const std::string& text) {
    return fmt::format(
        "<img class=\"{}\" width=\"{}\" height=\"{}\" alt=\"{}\" "
        "src=\"data:image/png;base64,{}\">",
        kind, images.width, images.height, xml_escaped(text), base64(png));
}

std::string pictures_html(const ScenePart& scene, const CheckRow& row, const RowImages& images) {
    const ReportHead& head = scene.report.head;
    const std::string part =
        images.width == head.width && images.height == head.height
            ? "The whole image."
            : fmt::format("The {}x{} pixels from pixel {},{} on, of {}x{}.", images.width,
                          images.height, images.left, images.top, head.width, head.height);
    const std::string where = fmt::format("frame {}, {}", row.frame, row.rays);
    return fmt::format(
        "<div class=\"pictures\"><figure data-compare><div class=\"stage\">{}{}</div>\n<div "
        "class=\"controls\" hidden><label>Reference left, variant right<input type=\"range\" "
        "min=\"0\" max=\"100\" value=\"50\"></label><button type=\"button\" "
        "aria-pressed=\"false\">Flicker</button><span class=\"shown note\"></span></div>"
        "<figcaption>Image of the reference and of the variant. {}</figcaption></figure>\n"
        "<figure>{}<figcaption>Difference: each differing pixel in the colour of its kind, 3x3 "
        "pixels large.</figcaption></figure></div>\n",
        image_html("expected", images.expected, images,
                   fmt::format("{} by the reference, {}", where, row.reference)),
        image_html("actual", images.actual, images,
                   fmt::format("{} by the variant, {}", where, row.variant())),
        part,
        image_html("difference", images.difference, images,
                   fmt::format("{}: {}", where, describe(row.difference))));
}

/// The images of a row if the page has room for them, or why not.
std::string pictures_of(const ScenePart& scene, std::size_t index, PageRoom& room) {
    const auto& all = scene.report.images;
    const auto images = std::ranges::find(all, index, &RowImages::row);
    if (images == all.end() || room.images == 0 || images->bytes() > room.image_bytes)
        return "<p class=\"note\">Its images are left out of this page; the folder of difference "
               "images has one.</p>\n";
    --room.images;
    room.image_bytes -= images->bytes();
    const std::string same =
        images->expected == images->actual
            ? "<p class=\"note\">Both images look the same: all colours are equal, and hits are "
              "not.</p>\n"
            : "";
    return same + pictures_html(scene, scene.report.rows[index], *images);
}

}  // namespace

std::string single_kind(const FrameDifference& difference) {
    for (const DifferenceKind& kind : difference_kinds()) {
        const std::uint64_t count = difference.*kind.count;
        if (count == difference.total())
            return fmt::format(" ({})", count == 1 ? kind.one : kind.several);
    }
    return "";
}

std::string differences_html(const ScenePart& scene, PageRoom& room, std::set<std::size_t>& shown) {
    std::string html;
    std::size_t left_out = 0;
    for (std::size_t i = 0; i < scene.report.rows.size(); ++i) {
        const CheckRow& row = scene.report.rows[i];
        if (row.equal()) continue;
        if (room.rows == 0) {
            ++left_out;
            continue;
        }
        --room.rows;
        shown.insert(i);
        const std::string id = row_id(scene, i);
        html += fmt::format(
            "<section><h3 id=\"{0}\" tabindex=\"-1\">frame "
            "{1}, {2}, {3}: {4}</h3>\n",
            id, row.frame, xml_escaped(row.variant()), xml_escaped(row.rays),
            (row.difference.total() == 1
                 ? "1 pixel differs"
                 : fmt::format("{} pixels differ", row.difference.total())) +
                single_kind(row.difference));
        html += kinds_html(row.difference) + pictures_of(scene, i, room) + pixels_html(id, row) +
                commands_html(scene, id, row) + "</section>\n";
    }
    if (left_out > 0)
        html += fmt::format(
            "<p class=\"note\">{} more images differ, which this page does not "
            "describe; its JSON has their counts.</p>\n",
            left_out);
    return html;
}

}  // namespace mray::app
