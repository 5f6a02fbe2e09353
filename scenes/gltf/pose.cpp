#include "scenes/gltf/pose.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <map>

#include "scenes/mesh/mesh_rules.h"

namespace mray::gltf {
namespace {

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

// Vertices whose positions in double stay in the cache of a core.
constexpr std::size_t kBlockSize = 1024;

Columns columns_of(const Affine& a) {
    Columns result;
    for (std::size_t k = 0; k < 4; ++k) {
        for (int axis = 0; axis < 3; ++axis) result.column[k][axis] = a.column[k][axis];
        result.column[k][3] = k == 3 ? 1.0 : 0.0;
    }
    return result;
}

using Scratch = std::array<double, 3 * kBlockSize>;

void morph(const VertexSet& set, std::span<const double> weights, std::size_t begin,
           std::size_t end, Scratch& positions) {
    const float* const still = &set.positions[begin].x;
    for (std::size_t i = 0; i < 3 * (end - begin); ++i)
        positions[i] = static_cast<double>(still[i]);
    for (std::size_t k = 0; k < set.targets.size(); ++k) {
        if (weights[k] == 0 || set.targets[k].empty()) continue;
        const float* const deltas = &set.targets[k][begin].x;
        for (std::size_t i = 0; i < 3 * (end - begin); ++i)
            positions[i] += weights[k] * static_cast<double>(deltas[i]);
    }
}

bool is_bad(const vec3& p) { return !MeshRules::is_good(p); }

void place_rigid(const Affine& to_world, const Scratch& positions, std::span<vec3> out) {
    for (std::size_t i = 0; i < out.size(); ++i) {
        const double* const p = &positions[3 * i];
        out[i] = vec3(transformed(to_world, {p[0], p[1], p[2]}));
    }
}

std::map<std::uint32_t, std::vector<Columns>> joint_maps(const GltfScene& scene, const Pose& pose) {
    std::map<std::uint32_t, std::vector<Columns>> maps;
    for (const auto& [index, skin] : scene.skins) {
        std::vector<Columns>& columns = maps[index];
        for (std::size_t i = 0; i < skin.joints.size(); ++i) {
            columns.push_back(
                columns_of(product(pose.to_world[skin.joints[i]], skin.inverse_binds[i])));
        }
    }
    return maps;
}

}  // namespace

Pose pose_at(const GltfScene& scene, double seconds, const Origin& origin) {
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
    for (Affine& map : pose.to_world) map.column[3] -= origin.at;
    for (const Part& part : scene.parts) {
        const auto animated = weights.find(scene.tree.nodes[part.node].file_index);
        pose.weights.push_back(animated == weights.end() ? rest_weights(scene, part)
                                                         : animated->second);
    }
    return pose;
}

Skinning::Skinning(const GltfScene& scene, const SimdTarget& target)
    : scene_(scene), place_skinned_(place_skinned_on(target)) {
    for (std::size_t part = 0; part < scene.parts.size(); ++part) {
        const std::size_t count = scene.parts[part].set->positions.size();
        for (std::size_t begin = 0; begin < count; begin += kBlockSize) {
            blocks_.push_back({static_cast<std::uint32_t>(part), static_cast<std::uint32_t>(begin),
                               static_cast<std::uint32_t>(std::min(begin + kBlockSize, count))});
        }
    }
}

std::size_t Skinning::place(const Pose& pose, std::span<vec3> out) const {
    const std::map<std::uint32_t, std::vector<Columns>> joints = joint_maps(scene_, pose);
    std::atomic<std::size_t> first_bad = kNoVertex;
    tbb::parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t index) {
        const Block& block = blocks_[index];
        const Part& part = scene_.parts[block.part];
        Scratch positions;
        const bool is_morphed = !part.set->targets.empty();
        if (is_morphed || !part.skin)
            morph(*part.set, pose.weights[block.part], block.begin, block.end, positions);
        const std::span<vec3> placed =
            out.subspan(part.first_vertex + block.begin, block.end - block.begin);
        if (part.skin) {
            const Influences& influences = part.set->influences;
            const std::size_t first = block.begin * influences.per_vertex;
            place_skinned_(
                {joints.at(*part.skin).data(), influences.per_vertex, &influences.joints[first],
                 &influences.weights[first], &part.set->positions[block.begin],
                 is_morphed ? positions.data() : nullptr, placed.size()},
                placed.data());
        } else {
            place_rigid(pose.to_world[part.node], positions, placed);
        }
        if (MeshRules::are_good(placed)) return;
        const auto vertex = static_cast<std::size_t>(
            std::find_if(placed.begin(), placed.end(), is_bad) - out.begin());
        std::size_t known = first_bad.load();
        while (vertex < known && !first_bad.compare_exchange_weak(known, vertex)) {
        }
    });
    return first_bad;
}

}  // namespace mray::gltf
