#include "scenes/gltf/gltf_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <string>

namespace mray::gltf {
namespace {

// Joints are numbers of 16 bits.
constexpr std::size_t kMaxJoints = 65536;

Affine matrix_of(const float* m) {
    Affine matrix;
    for (std::size_t k = 0; k < 4; ++k) {
        matrix.column[k] = {static_cast<double>(m[4 * k]), static_cast<double>(m[4 * k + 1]),
                            static_cast<double>(m[4 * k + 2])};
    }
    return matrix;
}

/// JOINTS_n and WEIGHTS_n for n = 0, 1, ...: four numbers a vertex each.
struct InfluenceSets {
    std::vector<std::vector<std::uint32_t>> joints;
    std::vector<std::vector<float>> weights;
};

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

void require_weights(const JsonAt& at, std::span<const float> weights) {
    for (std::size_t i = 0; i < weights.size(); ++i) {
        // False for NaN, too; weights are far below this.
        constexpr float kMost = 1e30f;
        if (weights[i] >= 0 && weights[i] <= kMost) continue;
        at.fail("vertex {} has the weight {}; must be finite and at least 0", i / kPerSet,
                weights[i]);
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

}  // namespace

Skin read_skin(const GltfFile& file, std::size_t index) {
    const JsonAt at = file.element("skins", index);
    const JsonAt joints = at.at("joints");
    const std::size_t joint_count = joints.size();
    if (joint_count == 0 || joint_count > kMaxJoints)
        joints.fail("has {} joints; must be from 1 to {}", joint_count, kMaxJoints);
    Skin skin;
    for (std::size_t i = 0; i < joint_count; ++i)
        skin.joints.push_back(joints[i].index_below(file.count("nodes"), "nodes"));
    skin.inverse_binds.resize(joint_count);
    const auto reference = at.find("inverseBindMatrices");
    if (!reference) return skin;
    const std::vector<float> values = floats(file, *reference, {.width = 16});
    if (values.size() / 16 < joint_count)
        reference->fail("has {} matrices for {} joints", values.size() / 16, joint_count);
    for (std::size_t i = 0; i < joint_count; ++i) {
        for (std::size_t k = 0; k < 16; ++k) {
            if (!std::isfinite(values[16 * i + k])) reference->fail("matrix {} is not finite", i);
        }
        skin.inverse_binds[i] = matrix_of(&values[16 * i]);
    }
    return skin;
}

Influences read_influences(const GltfFile& file, const JsonAt& attributes, std::size_t vertex_count,
                           bool lenient, WarningCount& unweighted) {
    InfluenceSets sets;
    for (int set = 0;; ++set) {
        const std::string joints_name = fmt::format("JOINTS_{}", set);
        const std::string weights_name = fmt::format("WEIGHTS_{}", set);
        const auto joints = attributes.find(joints_name);
        const auto weights = attributes.find(weights_name);
        if (!joints && !weights) break;
        if (!joints || !weights) attributes.fail("has no {}", joints ? weights_name : joints_name);
        sets.joints.push_back(integers(file, *joints, kPerSet, vertex_count));
        sets.weights.push_back(
            floats(file, *weights, {kPerSet, Wanted::Integers::kNormalized, vertex_count}));
        require_weights(*weights, sets.weights.back());
    }
    if (sets.joints.empty()) return {};
    return joined_influences(sets, [&](std::size_t vertex) {
        const std::string what = fmt::format("vertex {} has no weight above 0", vertex);
        if (!lenient) attributes.fail(what + "; repair it", Hint::kLenient);
        unweighted.add([&] {
            return Warning{file.name(), fmt::format("{}: {}; moves with its first joint",
                                                    attributes.path(), what)};
        });
    });
}

}  // namespace mray::gltf
