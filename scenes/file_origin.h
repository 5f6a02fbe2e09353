// Coordinates of files, which may lie too far from 0 for the steps of floats.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <glm/vec3.hpp>

#include "common/interop/platform.h"

namespace mray {

/// The place in a file's coordinates where world space has its 0.
struct FileOrigin {
    glm::dvec3 at = {0, 0, 0};
    bool operator==(const FileOrigin&) const = default;

    /// Rounded once to float, beyond floats to an infinity.
    vec3 to_world(const glm::dvec3& file) const;
    std::vector<vec3> to_world(std::span<const glm::dvec3> file) const;
    glm::dvec3 to_file(const glm::dvec3& world) const {
        // -0 stays -0.
        return at == glm::dvec3(0.0) ? world : world + at;
    }

    /// Whether to_world() moves a point, finite and within 1e30, by more than 1e-6 of the extent.
    bool rounds_coarsely(std::span<const glm::dvec3> file) const;

    /// The digits that a coordinate of a file is printed with.
    int digits() const { return *this == FileOrigin() ? 9 : 12; }
};

/// The centre in whole steps of a power of two of about the extent: subtracting it is exact.
FileOrigin centre_of(std::span<const glm::dvec3> file);
/// The origin for the points of a first frame: 0 unless that rounds coarsely and their centre not.
FileOrigin origin_of(std::span<const glm::dvec3> file);

/// As parse_double(), but a number that the nearest double moves to the middle of two floats is
/// left on its side of it, so that rounding it to float gives parse_float().
std::optional<double> parse_coordinate(std::string_view text);

}  // namespace mray
