// Rotation about any axis.
#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "scenes/trig.h"

namespace mray {

/// p turned about the unit vector axis (Rodrigues' formula).
inline glm::dvec3 rotate(const glm::dvec3& p, const glm::dvec3& axis, CosSin turn) {
    return turn.cos * p + turn.sin * glm::cross(axis, p) +
           (1 - turn.cos) * glm::dot(axis, p) * axis;
}

}  // namespace mray
