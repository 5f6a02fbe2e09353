// The joints and weights of vertices.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "scenes/gltf/meshes.h"

namespace mray::gltf {

/// JOINTS_n and WEIGHTS_n for n = 0, 1, ...: four numbers a vertex each.
struct InfluenceSets {
    std::vector<std::vector<std::uint32_t>> joints;
    std::vector<std::vector<float>> weights;
};

/// Throws Error(kBadInput) with `at` for a weight that is negative or not finite.
void require_weights(const JsonAt& at, std::span<const float> weights);

/// The influences of all sets (at least one), without those of weight 0. Calls `unweighted` for a
/// vertex that has none; if that returns, the vertex has its first joint with weight 1.
Influences joined_influences(const InfluenceSets& sets,
                             const std::function<void(std::size_t vertex)>& unweighted);

}  // namespace mray::gltf
