#include <fmt/format.h>

#include <algorithm>

#include "app/report/diff_report.h"
#include "app/report/json_parts.h"
#include "common/text/number_text.h"

namespace mray::app {
namespace {

Json part_of(const Hit& hit, std::uint32_t occlusion) {
    Json json = {{"occluded", occlusion}};
    if (hit.prim_id == kNoPrim) {
        json["prim_id"] = nullptr;
        return json;
    }
    json["prim_id"] = hit.prim_id;
    json["t"] = hex_text(hit.t);
    json["u"] = hex_text(hit.u);
    json["v"] = hex_text(hit.v);
    return json;
}

Json part_of(const PixelDifference& pixel) {
    return {{"pixel", {pixel.x, pixel.y}},
            {"expected", part_of(pixel.expected, pixel.expected_occlusion)},
            {"actual", part_of(pixel.actual, pixel.actual_occlusion)}};
}

/// The members that both kinds of reports begin with.
template <class Report>
Json head_of_diff(const Report& report) {
    Json json = head_of("diff");
    json["expected"] = report.expected;
    json["actual"] = report.actual;
    json["width"] = report.width;
    json["height"] = report.height;
    json["equal"] = report.equal();
    return json;
}

}  // namespace

std::string colour_text(std::uint32_t pixel) {
    std::string text = "#";
    for (int shift = 0; shift < 32; shift += 8)
        text += fmt::format("{:02x}", (pixel >> shift) & 0xFF);
    return text;
}

std::uint64_t DiffReport::differing_images() const {
    return static_cast<std::uint64_t>(std::ranges::count_if(
        images, [](const FrameDifference& difference) { return difference.total() != 0; }));
}

std::uint64_t DiffReport::differing_pixels() const {
    std::uint64_t count = 0;
    for (const FrameDifference& difference : images) count += difference.total();
    return count;
}

std::string to_json(const DiffReport& report) {
    Json json = head_of_diff(report);
    json["images"] = Json::array();
    for (const FrameDifference& difference : report.images) {
        Json pixels = Json::array();
        for (const PixelDifference& pixel : difference.first) pixels.push_back(part_of(pixel));
        json["images"].push_back({{"differences", of(difference)}, {"first", pixels}});
    }
    return json_text(json);
}

std::string to_json(const ImageDiffReport& report) {
    Json json = head_of_diff(report);
    json["differing_pixels"] = report.difference.total();
    for (std::size_t c = 0; c < report.channels.size(); ++c) {
        const ImageDiffReport::Channel& channel = report.channels[c];
        json["channels"][kChannelNames[c]] = {{"difference", channel.by},
                                              {"pixel", {channel.x, channel.y}}};
    }
    json["first"] = Json::array();
    for (const PixelDifference& pixel : report.difference.first)
        json["first"].push_back({{"pixel", {pixel.x, pixel.y}},
                                 {"expected", colour_text(pixel.expected_pixel)},
                                 {"actual", colour_text(pixel.actual_pixel)}});
    return json_text(json);
}

}  // namespace mray::app
