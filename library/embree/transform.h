// Affine transformations of instances.
#pragma once

#include "library/embree/rtcore.h"
#include "morphray/geometry.hpp"

namespace mray::embree {

/// Maps a point p to columns[0] * p.x + columns[1] * p.y + columns[2] * p.z + columns[3].
struct Transform {
    double columns[4][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}};

    morphray::Vec3 point(const morphray::Vec3& p) const;
    morphray::Vec3 vector(const morphray::Vec3& v) const;
    /// The inverse; that of a matrix without one has numbers that are not finite.
    Transform inverse() const;
    bool operator==(const Transform&) const = default;
};

/// Maps by `inner`, then by `outer`.
Transform operator*(const Transform& outer, const Transform& inner);

/// Reads a matrix of 3x4 or 4x4 floats, row or column major. Throws Failure for another format.
Transform read_transform(RTCFormat format, const void* floats);
/// Writes one.
void write_transform(const Transform& transform, RTCFormat format, void* floats);

}  // namespace mray::embree
