#include "scenes/gltf/influences.h"

#include <fmt/format.h>

#include <algorithm>

namespace mray::gltf {
namespace {

constexpr std::size_t kPerSet = 4;

/// The largest number of weights above 0 that a vertex has, at least 1.
std::size_t most_used(const InfluenceSets& sets, std::size_t vertex_count) {
    std::size_t most = 1;
    for (std::size_t vertex = 0; vertex < vertex_count; ++vertex) {
        std::size_t used = 0;
        for (const std::vector<float>& weights : sets.weights)
            for (std::size_t k = 0; k < kPerSet; ++k) used += weights[kPerSet * vertex + k] > 0;
        most = std::max(most, used);
    }
    return most;
}

}  // namespace

void require_weights(const JsonAt& at, std::span<const float> weights) {
    for (std::size_t i = 0; i < weights.size(); ++i) {
        // False for NaN, too; weights are far below this.
        constexpr float kMost = 1e30f;
        if (weights[i] >= 0 && weights[i] <= kMost) continue;
        at.fail(fmt::format("vertex {} has the weight {}; must be finite and at least 0",
                            i / kPerSet, weights[i]));
    }
}

Influences joined_influences(const InfluenceSets& sets,
                             const std::function<void(std::size_t vertex)>& unweighted) {
    const std::size_t vertex_count = sets.joints.front().size() / kPerSet;
    Influences result;
    result.per_vertex = most_used(sets, vertex_count);
    result.joints.reserve(vertex_count * result.per_vertex);
    result.weights.reserve(vertex_count * result.per_vertex);
    for (std::size_t vertex = 0; vertex < vertex_count; ++vertex) {
        const std::size_t begin = result.joints.size();
        const auto add = [&](std::uint32_t joint, float weight) {
            result.joints.push_back(static_cast<std::uint16_t>(joint));
            result.weights.push_back(weight);
            result.joint_limit = std::max(result.joint_limit, joint + 1);
        };
        for (std::size_t set = 0; set < sets.joints.size(); ++set) {
            for (std::size_t k = 0; k < kPerSet; ++k) {
                const float weight = sets.weights[set][kPerSet * vertex + k];
                if (weight > 0) add(sets.joints[set][kPerSet * vertex + k], weight);
            }
        }
        if (result.joints.size() == begin) {
            unweighted(vertex);
            add(sets.joints[0][kPerSet * vertex], 1);
        }
        // The joint of a weight that is not needed is one that moves the vertex.
        while (result.joints.size() < begin + result.per_vertex) add(result.joints[begin], 0);
    }
    return result;
}

}  // namespace mray::gltf
