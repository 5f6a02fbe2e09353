#include "scenes/gltf/motion/pose.h"

#include <array>

namespace mray::gltf {
namespace {

/// Writes the value of a channel into the transformation of its node.
void apply(const Channel& channel, double seconds, Trs& trs) {
    std::array<double, 4> value = {};
    sample(channel, seconds, std::span(value).first(channel.width));
    if (channel.target == Target::kRotation) {
        trs.rotation = {value[0], value[1], value[2], value[3]};
    } else if (channel.target == Target::kScale) {
        trs.scale = {value[0], value[1], value[2]};
    } else {
        trs.translation = {value[0], value[1], value[2]};
    }
}

Affine rest_of(const Node& node) { return node.matrix ? *node.matrix : affine_of(node.trs); }

const std::vector<double>& rest_weights(const GltfScene& scene, const Part& part) {
    const Node& node = scene.tree.nodes[part.node];
    return node.weights.empty() ? scene.meshes.at(*node.mesh).weights : node.weights;
}

}  // namespace

Pose pose_at(const GltfScene& scene, double seconds) {
    const std::vector<Node>& nodes = scene.tree.nodes;
    std::map<std::uint32_t, Trs> moved;
    std::map<std::uint32_t, std::vector<double>> weights;
    for (const Channel& channel : scene.animation.channels) {
        if (channel.target == Target::kWeights) {
            std::vector<double>& value = weights[channel.node];
            value.resize(channel.width);
            sample(channel, seconds, value);
        } else {
            apply(channel, seconds,
                  moved.try_emplace(channel.node, nodes[channel.node].trs).first->second);
        }
    }
    Pose pose;
    pose.to_world.resize(nodes.size());
    for (const std::uint32_t index : scene.tree.parents_first) {
        const auto trs = moved.find(index);
        const Affine local = trs == moved.end() ? rest_of(nodes[index]) : affine_of(trs->second);
        const std::uint32_t parent = nodes[index].parent;
        pose.to_world[index] = parent == kNoNode ? local : product(pose.to_world[parent], local);
    }
    for (const Part& part : scene.parts) {
        const auto animated = weights.find(part.node);
        pose.weights.push_back(animated == weights.end() ? rest_weights(scene, part)
                                                         : animated->second);
    }
    return pose;
}

}  // namespace mray::gltf
