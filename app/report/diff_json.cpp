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

}  // namespace

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
    Json json = head_of("diff");
    json["expected"] = report.expected;
    json["actual"] = report.actual;
    json["width"] = report.width;
    json["height"] = report.height;
    json["equal"] = report.equal();
    json["images"] = Json::array();
    for (const FrameDifference& difference : report.images) {
        Json pixels = Json::array();
        for (const PixelDifference& pixel : difference.first) pixels.push_back(part_of(pixel));
        json["images"].push_back({{"differences", of(difference)}, {"first", pixels}});
    }
    return json_text(json);
}

}  // namespace mray::app
