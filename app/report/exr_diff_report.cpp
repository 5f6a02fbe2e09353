#include "app/report/exr_diff_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string_view>

#include "common/text/number_text.h"

namespace mray::app {
namespace {

/// In the order of ExrKind.
constexpr std::array<ExrKindInfo, kExrKindCount> kKinds = {{
    {"prim_id", 0xFF00FFFF},    // yellow
    {"geom_id", 0xFF00A5FF},    // orange
    {"t", 0xFF00FF00},          // green
    {"uv", 0xFFFFFF00},         // cyan
    {"normal", 0xFF0000FF},     // red
    {"occlusion", 0xFFFF4040},  // blue
    {"colour", 0xFFFF00FF},     // magenta
    {"other", 0xFFFFFFFF},      // white
}};

}  // namespace

const ExrKindInfo& info_of(ExrKind kind) { return kKinds[static_cast<std::size_t>(kind)]; }

ExrKind kind_of_channel(const std::string& name) {
    const std::string_view layer = std::string_view(name).substr(0, name.rfind('.'));
    if (name == "id.prim") return ExrKind::kPrimId;
    if (name == "id.geom") return ExrKind::kGeomId;
    if (name == "Z" || layer == "depth") return ExrKind::kT;
    if (layer == "barycentric") return ExrKind::kUv;
    if (layer == "normal") return ExrKind::kNormal;
    if (layer == "occlusion") return ExrKind::kOcclusion;
    for (const char* colour : {"R", "G", "B", "A", "Y"})
        if (name == colour) return ExrKind::kColour;
    return ExrKind::kOther;
}

std::uint64_t ExrComparison::pixels() const {
    return std::accumulate(kinds.begin(), kinds.end(), std::uint64_t{0});
}

bool ExrComparison::equal() const {
    return std::ranges::all_of(channels, &ExrChannelDifference::equal);
}

std::string value_text(ExrType type, std::uint32_t bits) {
    if (type == ExrType::kUint) return fmt::format("{}", bits);
    const double value = value_of(type, bits);
    // Not all of them have the same bits.
    if (std::isnan(value)) return fmt::format("nan {:#x}", bits);
    return hex_text(value);
}

}  // namespace mray::app
