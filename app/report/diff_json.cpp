#include <fmt/format.h>

#include "app/report/diff_report.h"
#include "app/report/exr_diff_report.h"
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

/// The members that all kinds of reports begin with.
Json head_of_diff(const std::string& expected, const std::string& actual, std::uint32_t width,
                  std::uint32_t height, bool equal) {
    Json json = head_of("diff");
    json["expected"] = expected;
    json["actual"] = actual;
    json["width"] = width;
    json["height"] = height;
    json["equal"] = equal;
    return json;
}

template <class Report>
Json head_of_diff(const Report& report) {
    return head_of_diff(report.expected, report.actual, report.width, report.height,
                        report.equal());
}

Json type_of(const std::optional<ExrType>& type) {
    return type ? Json(name_of(*type)) : Json(nullptr);
}

Json part_of(const ExrChannelDifference& channel) {
    return {{"kind", info_of(channel.kind).name},
            {"expected_type", type_of(channel.expected_type)},
            {"actual_type", type_of(channel.actual_type)},
            {"differing_pixels", channel.pixels},
            {"not_finite", channel.not_finite},
            {"difference", channel.by},
            {"pixel", {channel.x, channel.y}}};
}

Json part_of(const ExrPixelDifference& pixel, const ExrComparison& comparison) {
    Json json = {{"pixel", {pixel.x, pixel.y}}};
    for (const ExrPixelDifference::Value& value : pixel.values) {
        const ExrChannelDifference& channel = comparison.channels[value.channel];
        json["expected"][channel.name] = value_text(*channel.actual_type, value.expected);
        json["actual"][channel.name] = value_text(*channel.actual_type, value.actual);
    }
    return json;
}

}  // namespace

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

std::string to_json(const ExrDiffReport& report) {
    const ExrComparison& comparison = report.comparison;
    Json json = head_of_diff(report.expected, report.actual, comparison.width, comparison.height,
                             comparison.equal());
    json["differing_pixels"] = comparison.pixels();
    for (std::size_t k = 0; k < kExrKindCount; ++k)
        json["differences"][info_of(static_cast<ExrKind>(k)).name] = comparison.kinds[k];
    for (const ExrChannelDifference& channel : comparison.channels)
        json["channels"][channel.name] = part_of(channel);
    json["first"] = Json::array();
    for (const ExrPixelDifference& pixel : comparison.first)
        json["first"].push_back(part_of(pixel, comparison));
    return json_text(json);
}

}  // namespace mray::app
