// Skinning on vectors is compiled once for each target; the rest of this file, once.
#include "scenes/gltf/pose.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "scenes/gltf/pose.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace mray::gltf {
namespace HWY_NAMESPACE {

/// Four doubles, in one register or in two: arithmetic that no target may fuse.
using Double4 = double __attribute__((vector_size(4 * sizeof(double)), may_alias));

/// The fourth component of a place is 1, that of the sum the sum of the weights.
template <class Real, class PerVertex>
inline void place_all(const SkinnedVertices& vertices, const Real* p, PerVertex per_vertex,
                      vec3* out) {
    const std::uint16_t* joint = vertices.joints;
    const float* weight = vertices.weights;
    const std::size_t joint_count = per_vertex;
    for (std::size_t i = 0; i < vertices.count; ++i) {
        const double x = static_cast<double>(p[3 * i]);
        const double y = static_cast<double>(p[3 * i + 1]);
        const double z = static_cast<double>(p[3 * i + 2]);
        Double4 sum = {0, 0, 0, 0};
#pragma GCC unroll 4
        for (std::size_t k = 0; k < joint_count; ++k) {
            const auto* const column =
                reinterpret_cast<const Double4*>(vertices.maps[joint[k]].column);
            const Double4 place = column[0] * x + column[1] * y + column[2] * z + column[3];
            sum += place * static_cast<double>(weight[k]);
        }
        joint += joint_count;
        weight += joint_count;
        const double total = sum[3];
        sum /= Double4{total, total, total, total};
        out[i] = {static_cast<float>(sum[0]), static_cast<float>(sum[1]),
                  static_cast<float>(sum[2])};
    }
}

template <class Real>
inline void place_all(const SkinnedVertices& vertices, const Real* positions, vec3* out) {
    if (vertices.per_vertex == 4) {
        place_all(vertices, positions, std::integral_constant<std::size_t, 4>(), out);
    } else {
        place_all(vertices, positions, vertices.per_vertex, out);
    }
}

inline void place_skinned(const SkinnedVertices& vertices, vec3* out) {
    if (vertices.morphed != nullptr) {
        place_all(vertices, vertices.morphed, out);
    } else {
        place_all(vertices, &vertices.positions->x, out);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::gltf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include "common/simd/simd_dispatch-inl.h"

namespace mray::gltf {
namespace {

HWY_EXPORT(place_skinned);

double value_at(const Channel& channel, std::size_t key, std::size_t part, std::size_t k) {
    const bool is_spline = channel.interpolation == Interpolation::kCubicSpline;
    const std::size_t value = is_spline ? kSplineValues * key + part : key;
    return static_cast<double>(channel.values[value * channel.width + k]);
}

glm::dvec4 quaternion_at(const Channel& channel, std::size_t key) {
    return unit_quaternion({value_at(channel, key, 1, 0), value_at(channel, key, 1, 1),
                            value_at(channel, key, 1, 2), value_at(channel, key, 1, 3)});
}

void write(const glm::dvec4& q, std::span<double> out) {
    for (int k = 0; k < 4; ++k) out[static_cast<std::size_t>(k)] = q[k];
}

/// The last key at or before a time, or the end key, and the way to the next, in [0, 1).
struct KeyAt {
    std::size_t key = 0;
    double u = 0;
    /// From the key to the next one; 0 if u is 0.
    double seconds = 0;
};

KeyAt key_at(std::span<const float> times, double time) {
    const auto after = std::upper_bound(times.begin(), times.end(), time,
                                        [](double t, float key) { return t < double{key}; });
    if (after == times.begin()) return {};
    const auto key = static_cast<std::size_t>(after - times.begin()) - 1;
    if (after == times.end()) return {key};
    const double from = static_cast<double>(times[key]);
    const double seconds = static_cast<double>(times[key + 1]) - from;
    if (time == from) return {key};
    return {key, (time - from) / seconds, seconds};
}

void sample_spline(const Channel& channel, const KeyAt& at, std::span<double> out) {
    const std::array<double, 4> weights = hermite_weights(at.u, at.seconds);
    for (std::size_t k = 0; k < channel.width; ++k) {
        out[k] = weights[0] * value_at(channel, at.key, 1, k) +
                 weights[1] * value_at(channel, at.key, 2, k) +
                 weights[2] * value_at(channel, at.key + 1, 1, k) +
                 weights[3] * value_at(channel, at.key + 1, 0, k);
    }
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

void sample(const Channel& channel, double time, std::span<double> out) {
    const KeyAt at = key_at(channel.times, time);
    const bool is_rotation = channel.target == Target::kRotation;
    if (at.u == 0 || channel.interpolation == Interpolation::kStep) {
        for (std::size_t k = 0; k < channel.width; ++k) out[k] = value_at(channel, at.key, 1, k);
    } else if (channel.interpolation == Interpolation::kCubicSpline) {
        sample_spline(channel, at, out);
    } else if (is_rotation) {
        return write(
            slerp(quaternion_at(channel, at.key), quaternion_at(channel, at.key + 1), at.u), out);
    } else {
        for (std::size_t k = 0; k < channel.width; ++k) {
            const double a = value_at(channel, at.key, 1, k);
            out[k] = a + (value_at(channel, at.key + 1, 1, k) - a) * at.u;
        }
    }
    if (is_rotation) write(unit_quaternion({out[0], out[1], out[2], out[3]}), out);
}

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
            Trs& trs = moved.try_emplace(channel.node, nodes[channel.node].trs).first->second;
            double* const value = channel.target == Target::kRotation ? &trs.rotation.x
                                  : channel.target == Target::kScale  ? &trs.scale.x
                                                                      : &trs.translation.x;
            sample(channel, seconds, {value, channel.width});
        }
    }
    Pose pose;
    pose.to_world.resize(nodes.size());
    for (const std::uint32_t index : scene.tree.parents_first) {
        const auto trs = moved.find(index);
        const Affine local = trs == moved.end() ? nodes[index].rest() : affine_of(trs->second);
        const std::uint32_t parent = nodes[index].parent;
        pose.to_world[index] = parent == kNoNode ? local : product(pose.to_world[parent], local);
    }
    for (Affine& map : pose.to_world) map.column[3] -= origin.at;
    for (const PlacedSet& placed : scene.placed_sets) {
        const Node& node = nodes[placed.node];
        const auto animated = weights.find(placed.node);
        pose.weights.push_back(animated != weights.end() ? animated->second
                               : node.weights.empty()    ? scene.meshes.at(*node.mesh).weights
                                                         : node.weights);
    }
    return pose;
}

Skinning::Skinning(const GltfScene& scene, const SimdTarget& target)
    : scene_(scene), place_skinned_(SIMD_FUNCTION(place_skinned, target)) {}

bool Skinning::place(const Pose& pose, std::span<vec3> out) const {
    const std::map<std::uint32_t, std::vector<Columns>> joints = joint_maps(scene_, pose);
    std::atomic<bool> are_good = true;
    const auto place_block = [&](std::size_t index, std::size_t begin, std::size_t end) {
        const PlacedSet& of = scene_.placed_sets[index];
        Scratch positions;
        const bool is_morphed = !of.set->targets.empty();
        if (is_morphed || !of.skin) morph(*of.set, pose.weights[index], begin, end, positions);
        const std::span<vec3> placed = out.subspan(of.first_vertex + begin, end - begin);
        if (of.skin) {
            const Influences& influences = of.set->influences;
            const std::size_t first = begin * influences.per_vertex;
            place_skinned_(
                {joints.at(*of.skin).data(), influences.per_vertex, &influences.joints[first],
                 &influences.weights[first], &of.set->positions[begin],
                 is_morphed ? positions.data() : nullptr, placed.size()},
                placed.data());
        } else {
            for (std::size_t i = 0; i < placed.size(); ++i) {
                const double* const p = &positions[3 * i];
                placed[i] = vec3(transformed(pose.to_world[of.node], {p[0], p[1], p[2]}));
            }
        }
        if (!MeshRules::are_good(placed)) are_good = false;
    };
    using Range = tbb::blocked_range<std::size_t>;
    tbb::parallel_for(std::size_t{0}, scene_.placed_sets.size(), [&](std::size_t index) {
        tbb::parallel_for(
            Range(0, scene_.placed_sets[index].set->positions.size(), kBlockSize),
            [&](const Range& block) { place_block(index, block.begin(), block.end()); },
            tbb::simple_partitioner());
    });
    return are_good;
}

}  // namespace mray::gltf

#endif
