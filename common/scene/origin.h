// Coordinates of files and of callers' doubles, which may lie so far from 0 that the steps of
// floats are too coarse for them.
#pragma once

#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "common/interop/platform.h"

namespace mray {

/// The place in the given coordinates where world space has its 0.
struct Origin {
    glm::dvec3 at = {0, 0, 0};
    bool operator==(const Origin&) const = default;

    /// Rounded once to float, beyond floats to an infinity.
    vec3 to_world(const glm::dvec3& given) const;
    std::vector<vec3> to_world(std::span<const glm::dvec3> given) const;
    glm::dvec3 from_world(const glm::dvec3& world) const {
        // -0 stays -0.
        return at == glm::dvec3(0.0) ? world : world + at;
    }

    /// The farthest that to_world() moves a coordinate by rounding. Ignores points that are not
    /// finite, beyond 1e30, or 2^37 times as far from 0 as most.
    double rounding_of(std::span<const glm::dvec3> given) const;
    /// Whether that is more than 1e-6 of the extent of all points.
    bool rounds_coarsely(std::span<const glm::dvec3> given) const;

    /// The digits that a given coordinate is printed with.
    int digits() const { return *this == Origin() ? 9 : 12; }
};

/// The centre of points in whole steps of a power of two of about their extent, so that subtracting
/// it is exact.
Origin centre_of(std::span<const glm::dvec3> given);
/// The origin for the points of a first frame: 0 unless that rounds coarsely and their centre does
/// not.
Origin origin_of(std::span<const glm::dvec3> given);

}  // namespace mray
