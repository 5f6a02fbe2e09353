#include "library/src/point_block.h"

#include <cmath>

namespace morphray::detail {

PointBlock::PointBlock(SceneImpl& scene, std::span<const Vec3> all, std::size_t first,
                       std::size_t count, QueryFilter& filter)
    : scene_(scene),
      world_(all.subspan(first, count)),
      first_(first),
      filter_(filter),
      points_(count, mray::vec3(0, 0, 0)),
      exact_(count, mray::dvec3(0, 0, 0)),
      is_finite_(count) {
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3& p = world_[i];
        is_finite_[i] = std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) ? 1 : 0;
        if (is_finite_[i] != 0) scene.space().to_scene(p, exact_[i], points_[i]);
    }
}

void PointBlock::sort(PointOrder by) {
    constexpr std::size_t kFew = 64;
    if (points_.size() > kFew) order_ = order_points(points_, by);
}

PointPart::PointPart(const PointBlock& block, std::vector<std::uint32_t> places)
    : block_(block), places_(std::move(places)), points_(places_.size()) {
    for (std::size_t i = 0; i < size(); ++i) points_[i] = block.points_[places_[i]];
}

PointPart PointPart::only(std::span<const std::size_t> chosen) const {
    std::vector<std::uint32_t> places;
    for (const std::size_t i : chosen) places.push_back(places_[i]);
    return {block_, std::move(places)};
}

}  // namespace morphray::detail
