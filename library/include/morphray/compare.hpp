// Comparison of two scenes that should give the same answers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "morphray/error.hpp"
#include "morphray/geometry.hpp"
#include "morphray/image.hpp"
#include "morphray/queries.hpp"

namespace morphray {

class Scene;

struct HitDifference {
    /// The number of the ray, or of the camera ray of an image, row by row.
    std::size_t index = 0;
    Hit first;
    Hit second;
};

/// The hits that differ in any bit.
struct Comparison {
    std::uint64_t compared = 0;
    std::uint64_t different = 0;
    /// The first ones, in ascending order.
    std::vector<HitDifference> differences;

    bool equal() const { return different == 0; }
};

/// Traces the rays in both scenes. `keep` limits Comparison::differences.
/// Throws what Scene::intersect() throws.
MORPHRAY_API Comparison compare(const Scene& first, const Scene& second, std::span<const Ray> rays,
                                std::size_t keep = 10, const QueryOptions& options = {});
/// Compares hits, occlusion and pixels; what differs counts once for each camera ray. Throws
/// bad_argument for images of different sizes.
MORPHRAY_API Comparison compare(const Image& first, const Image& second, std::size_t keep = 10);

/// "1000 equal", or "3 of 1000 differ" and a line for each of the first ones.
MORPHRAY_API std::string describe(const Comparison& comparison);

}  // namespace morphray
