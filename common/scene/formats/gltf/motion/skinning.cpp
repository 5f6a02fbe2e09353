#include "common/scene/formats/gltf/motion/skinning.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <map>

#include "common/scene/formats/obj/obj_checker.h"

namespace mray::gltf {
namespace {

// Vertices whose positions in double stay in the cache of a core.
constexpr std::size_t kBlockSize = 1024;

/// Four doubles, which the compiler keeps in vectors of the target.
using Double4 = double __attribute__((vector_size(4 * sizeof(double))));

/// The columns of an affine map; the fourth row is 0, 0, 0, 1.
struct Columns {
    Double4 column[4];
};

Columns columns_of(const Affine& a) {
    Columns result;
    for (std::size_t k = 0; k < 4; ++k) {
        const glm::dvec3& c = a.column[k];
        result.column[k] = Double4{c.x, c.y, c.z, k == 3 ? 1.0 : 0.0};
    }
    return result;
}

using Scratch = std::array<double, 3 * kBlockSize>;

/// Adds `weight` times the displacements of vertices [begin, end) to their positions.
void add_target(const MorphTarget& target, double weight, std::size_t begin, std::size_t end,
                Scratch& positions) {
    const auto add = [&](std::size_t vertex, const vec3& delta) {
        double* const p = &positions[3 * (vertex - begin)];
        p[0] += weight * static_cast<double>(delta.x);
        p[1] += weight * static_cast<double>(delta.y);
        p[2] += weight * static_cast<double>(delta.z);
    };
    if (target.vertices.empty()) {
        for (std::size_t i = begin; i < std::min(end, target.deltas.size()); ++i)
            add(i, target.deltas[i]);
        return;
    }
    const auto first = std::lower_bound(target.vertices.begin(), target.vertices.end(), begin);
    for (auto vertex = first; vertex != target.vertices.end() && *vertex < end; ++vertex)
        add(*vertex, target.deltas[static_cast<std::size_t>(vertex - target.vertices.begin())]);
}

void morph(const VertexSet& set, std::span<const double> weights, std::size_t begin,
           std::size_t end, Scratch& positions) {
    for (std::size_t i = begin; i < end; ++i) {
        double* const p = &positions[3 * (i - begin)];
        p[0] = static_cast<double>(set.positions[i].x);
        p[1] = static_cast<double>(set.positions[i].y);
        p[2] = static_cast<double>(set.positions[i].z);
    }
    for (std::size_t k = 0; k < set.targets.size(); ++k)
        if (weights[k] != 0) add_target(set.targets[k], weights[k], begin, end, positions);
}

bool is_bad(const vec3& p) {
    // True for NaN, too.
    return !(std::abs(p.x) <= kMaxCoordinate && std::abs(p.y) <= kMaxCoordinate &&
             std::abs(p.z) <= kMaxCoordinate);
}

/// Writes places and returns whether one of them cannot be used.
bool place_rigid(const Affine& to_world, const Scratch& positions, std::span<vec3> out) {
    bool bad = false;
    for (std::size_t i = 0; i < out.size(); ++i) {
        const double* const p = &positions[3 * i];
        out[i] = vec3(transformed(to_world, {p[0], p[1], p[2]}));
        bad |= is_bad(out[i]);
    }
    return bad;
}

bool place_skinned(std::span<const Columns> joints, const Influences& influences, std::size_t begin,
                   const Scratch& positions, std::span<vec3> out) {
    const std::size_t per_vertex = influences.per_vertex;
    const std::uint16_t* joint = &influences.joints[begin * per_vertex];
    const float* weight = &influences.weights[begin * per_vertex];
    bool bad = false;
    for (std::size_t i = 0; i < out.size(); ++i) {
        const double* const p = &positions[3 * i];
        Double4 sum = {0, 0, 0, 0};
        for (std::size_t k = 0; k < per_vertex; ++k) {
            const Columns& m = joints[*joint++];
            const Double4 place =
                m.column[0] * p[0] + m.column[1] * p[1] + m.column[2] * p[2] + m.column[3];
            sum += place * static_cast<double>(*weight++);
        }
        // The fourth component is the sum of the weights.
        sum /= Double4{sum[3], sum[3], sum[3], sum[3]};
        out[i] = {static_cast<float>(sum[0]), static_cast<float>(sum[1]),
                  static_cast<float>(sum[2])};
        bad |= is_bad(out[i]);
    }
    return bad;
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

Skinning::Skinning(const GltfScene& scene) : scene_(scene) {
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
        morph(*part.set, pose.weights[block.part], block.begin, block.end, positions);
        const std::span<vec3> placed =
            out.subspan(part.first_vertex + block.begin, block.end - block.begin);
        const bool bad = part.skin ? place_skinned(joints.at(*part.skin), part.set->influences,
                                                   block.begin, positions, placed)
                                   : place_rigid(pose.to_world[part.node], positions, placed);
        if (!bad) return;
        const auto vertex = static_cast<std::size_t>(
            std::find_if(placed.begin(), placed.end(), is_bad) - out.begin());
        std::size_t known = first_bad.load();
        while (vertex < known && !first_bad.compare_exchange_weak(known, vertex)) {
        }
    });
    return first_bad;
}

}  // namespace mray::gltf
