// Where the nodes and vertices of a glTF scene are at a time.
#pragma once

#include "common/simd/simd_target.h"
#include "scenes/gltf/gltf_scene.h"

namespace mray::gltf {

/// The value of a channel at a time in seconds; a rotation has length 1.
void sample(const Channel& channel, double time, std::span<double> out);

struct Pose {
    /// From the space of each node to world space.
    std::vector<Affine> to_world;
    /// weights[placed_set][target]: one for each placed set and each morph target of its mesh.
    std::vector<std::vector<double>> weights;
};

/// `seconds` before the first and after the last key are those keys. World space is that of an
/// origin. A pure function: the bits do not depend on machine, threads or earlier calls.
Pose pose_at(const GltfScene& scene, double seconds, const Origin& origin = {});

/// The columns of an affine map; the fourth row is 0, 0, 0, 1.
struct alignas(32) Columns {
    double column[4][4];
};

/// Vertices with `per_vertex` joints and weights each.
struct SkinnedVertices {
    /// The maps of the skin's joints, which `joints` are indices of.
    const Columns* maps;
    std::size_t per_vertex;
    const std::uint16_t* joints;
    const float* weights;
    /// The position of each vertex; not used if there are morphed ones.
    const vec3* positions;
    /// x, y, z of each after morph targets; null without these.
    const double* morphed;
    std::size_t count;
};

/// Places vertices: a morph target adds weight times displacement; a vertex with a skin is the
/// weighted mean of its places under its joints, others follow their node (glTF 2.0, 3.7.3 and
/// 3.7.2.2). Computed in double and rounded once, in an order that depends on the file alone.
class Skinning {
public:
    /// The scene must outlive it.
    explicit Skinning(const GltfScene& scene, const SimdTarget& target = best_simd_target());

    /// Returns whether all vertices are finite and within 1e30. The bits depend neither on threads
    /// nor on the instruction set.
    bool place(const Pose& pose, std::span<vec3> out) const;

private:
    const GltfScene& scene_;
    void (*place_skinned_)(const SkinnedVertices& vertices, vec3* out);
};

}  // namespace mray::gltf
