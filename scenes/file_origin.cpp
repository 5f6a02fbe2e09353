#include "scenes/file_origin.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include <glm/common.hpp>

#include "common/text/number_text.h"

namespace mray {
namespace {

constexpr double kCoarse = 1e-6;
// Of coordinates that are used; a mesh file with others is refused or read leniently.
constexpr double kMostUsed = 1e30;

struct Extent {
    glm::dvec3 lower = glm::dvec3(std::numeric_limits<double>::infinity());
    glm::dvec3 upper = glm::dvec3(-std::numeric_limits<double>::infinity());
    /// 0 without points.
    double size() const {
        const glm::dvec3 size = upper - lower;
        return std::max({size.x, size.y, size.z, 0.0});
    }
};

/// False for NaN, too.
bool is_used(const glm::dvec3& p) {
    return std::abs(p.x) <= kMostUsed && std::abs(p.y) <= kMostUsed && std::abs(p.z) <= kMostUsed;
}

Extent extent_of(std::span<const glm::dvec3> points) {
    Extent extent;
    for (const glm::dvec3& p : points) {
        if (!is_used(p)) continue;
        extent.lower = glm::min(extent.lower, p);
        extent.upper = glm::max(extent.upper, p);
    }
    return extent;
}

float to_float(double x) {
    constexpr double kMost = std::numeric_limits<float>::max();
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    // The cast of a double beyond floats is undefined.
    if (x > kMost) return kInfinity;
    return x < -kMost ? -kInfinity : static_cast<float>(x);
}

}  // namespace

vec3 FileOrigin::to_world(const glm::dvec3& file) const {
    return {to_float(file.x - at.x), to_float(file.y - at.y), to_float(file.z - at.z)};
}

std::vector<vec3> FileOrigin::to_world(std::span<const glm::dvec3> file) const {
    std::vector<vec3> world(file.size());
    std::ranges::transform(file, world.begin(), [&](const auto& p) { return to_world(p); });
    return world;
}

bool FileOrigin::rounds_coarsely(std::span<const glm::dvec3> file) const {
    const Extent extent = extent_of(file);
    const double most = kCoarse * extent.size();
    const glm::dvec3 far = glm::max(glm::abs(extent.lower - at), glm::abs(extent.upper - at));
    // Half a step of the floats of that size, at least half of the least float.
    if (std::max({far.x, far.y, far.z, 0x1p-126}) * 0x1p-24 <= most) return false;
    return std::ranges::any_of(file, [&](const glm::dvec3& p) {
        if (!is_used(p)) return false;
        const glm::dvec3 moved = glm::abs(glm::dvec3(to_world(p)) - (p - at));
        return moved.x > most || moved.y > most || moved.z > most;
    });
}

FileOrigin centre_of(std::span<const glm::dvec3> file) {
    const Extent extent = extent_of(file);
    const double size = extent.size();
    if (!(size > 0)) return {};
    const double step = std::ldexp(1.0, std::ilogb(size));
    return {glm::round((extent.lower + extent.upper) / (2 * step)) * step};
}

FileOrigin origin_of(std::span<const glm::dvec3> file) {
    if (!FileOrigin().rounds_coarsely(file)) return {};
    const FileOrigin centre = centre_of(file);
    // Points may be too close together for any.
    return centre.rounds_coarsely(file) ? FileOrigin() : centre;
}

std::optional<double> parse_coordinate(std::string_view text) {
    const std::optional<double> number = parse_double(text);
    constexpr std::uint64_t kBitsBelowFloat = (std::uint64_t{1} << 29) - 1;
    constexpr std::uint64_t kMiddle = std::uint64_t{1} << 28;
    constexpr double kLeastNormal = std::numeric_limits<float>::min();
    if (!number || *number == 0 ||
        (std::abs(*number) >= kLeastNormal &&
         (std::bit_cast<std::uint64_t>(*number) & kBitsBelowFloat) != kMiddle))
        return number;
    const float nearest = parse_float(text).value_or(0.0f);
    if (to_float(*number) == nearest) return number;
    return std::nextafter(*number, static_cast<double>(nearest));
}

}  // namespace mray
