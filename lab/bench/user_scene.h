// A scene of the benchmark behind the public interface.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "common/interop/constants.h"
#include "common/interop/ray.h"
#include "morphray/morphray.hpp"

namespace mray::bench {

/// Scene space as the world of the library's users, with bounds that make both the same.
inline constexpr double kUserExtent = kSceneExtent;
inline const morphray::Box kUserBounds{{-kUserExtent, -kUserExtent, -kUserExtent},
                                       {kUserExtent, kUserExtent, kUserExtent}};

inline morphray::Vec3 to_user(vec3 p) { return {p.x, p.y, p.z}; }

inline std::vector<morphray::Vec3> to_user(std::span<const vec3> points) {
    std::vector<morphray::Vec3> result(points.size());
    std::transform(points.begin(), points.end(), result.begin(), [](vec3 p) { return to_user(p); });
    return result;
}

inline std::vector<morphray::Ray> to_user(const std::vector<Ray>& rays) {
    std::vector<morphray::Ray> result;
    result.reserve(rays.size());
    for (const Ray& ray : rays)
        result.push_back({.org = to_user(ray.org), .dir = to_user(ray.dir)});
    return result;
}

}  // namespace mray::bench
