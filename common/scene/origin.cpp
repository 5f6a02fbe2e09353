#include "common/scene/origin.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include <glm/common.hpp>

#include "common/scene/scene_space.h"

namespace mray {
namespace {

constexpr double kCoarse = 1e-6;
// Of coordinates that are used; those beyond it may overflow in differences of floats.
constexpr double kMostUsed = 1e30;

double farthest(const glm::dvec3& p) {
    return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
}

/// False for NaN, too.
bool is_used(const glm::dvec3& p) {
    return std::abs(p.x) <= kMostUsed && std::abs(p.y) <= kMostUsed && std::abs(p.z) <= kMostUsed;
}

/// The points that are used and not as far away as PoseExtent::limit() says.
class NearPoints {
public:
    explicit NearPoints(std::span<const glm::dvec3> all) : all_(all) {
        // The exponents of doubles, the least first.
        constexpr int kLeast = -1075;
        std::array<std::uint64_t, 2100> counts{};
        std::uint64_t total = 0;
        for (const glm::dvec3& p : all) {
            if (!is_used(p) || farthest(p) == 0) continue;
            ++counts[static_cast<std::size_t>(std::ilogb(farthest(p)) - kLeast)];
            ++total;
        }
        std::uint64_t held = 0;
        std::size_t bulk = 0;
        while (2 * held <= total && bulk + 1 < counts.size()) held += counts[++bulk];
        limit_ = std::ldexp(1.0, static_cast<int>(bulk) + kLeast + 1 + kFarExponent);
    }

    template <class Visit>
    void for_each(Visit visit) const {
        for (const glm::dvec3& p : all_)
            if (is_used(p) && farthest(p) <= limit_) visit(p);
    }

private:
    std::span<const glm::dvec3> all_;
    double limit_;
};

struct Extent {
    glm::dvec3 lower = glm::dvec3(std::numeric_limits<double>::infinity());
    glm::dvec3 upper = glm::dvec3(-std::numeric_limits<double>::infinity());
    /// 0 without points.
    double size() const {
        const glm::dvec3 size = upper - lower;
        return std::max({size.x, size.y, size.z, 0.0});
    }
};

Extent extent_of(std::span<const glm::dvec3> points) {
    Extent extent;
    NearPoints(points).for_each([&](const glm::dvec3& p) {
        extent.lower = glm::min(extent.lower, p);
        extent.upper = glm::max(extent.upper, p);
    });
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

vec3 Origin::to_world(const glm::dvec3& given) const {
    return {to_float(given.x - at.x), to_float(given.y - at.y), to_float(given.z - at.z)};
}

std::vector<vec3> Origin::to_world(std::span<const glm::dvec3> given) const {
    std::vector<vec3> world(given.size());
    std::ranges::transform(given, world.begin(), [&](const auto& p) { return to_world(p); });
    return world;
}

double Origin::rounding_of(std::span<const glm::dvec3> given) const {
    double most = 0;
    NearPoints(given).for_each([&](const glm::dvec3& p) {
        const glm::dvec3 moved = glm::abs(glm::dvec3(to_world(p)) - (p - at));
        most = std::max({most, moved.x, moved.y, moved.z});
    });
    return most;
}

bool Origin::rounds_coarsely(std::span<const glm::dvec3> given) const {
    const Extent extent = extent_of(given);
    const double most = kCoarse * extent.size();
    const glm::dvec3 far = glm::max(glm::abs(extent.lower - at), glm::abs(extent.upper - at));
    // Half a step of the floats of that size, at least half of the least float.
    if (std::max({far.x, far.y, far.z, 0x1p-126}) * 0x1p-24 <= most) return false;
    return rounding_of(given) > most;
}

Origin centre_of(std::span<const glm::dvec3> given) {
    const Extent extent = extent_of(given);
    const double size = extent.size();
    if (!(size > 0)) return {};
    const double step = std::ldexp(1.0, std::ilogb(size));
    return {glm::round((extent.lower + extent.upper) / (2 * step)) * step};
}

Origin origin_of(std::span<const glm::dvec3> given) {
    if (!Origin().rounds_coarsely(given)) return {};
    const Origin centre = centre_of(given);
    // Points may be too close together for any.
    return centre.rounds_coarsely(given) ? Origin() : centre;
}

}  // namespace mray
