// Meshes in arrays of a caller of the public interface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/scene/mesh.h"
#include "morphray/mesh.hpp"

namespace mray::fuzz {

/// A mesh with all that a MeshView may have. It is made from a seed, and rarely has a fault for
/// which build() and attach() refuse it.
class CallMesh {
public:
    explicit CallMesh(std::uint64_t seed);
    CallMesh(const CallMesh&) = delete;

    /// The mesh with the positions in its own array, which is the caller's; or in another one.
    morphray::MeshView view() const;
    morphray::MeshView view(std::span<const vec3> positions) const;

    std::size_t vertex_count() const { return first_.size(); }
    std::vector<vec3> positions() const;
    std::span<const uvec3> triangles() const { return triangles_; }
    bool deforms() const { return deforms_; }
    /// Writes other positions into its array: still, moved, out of all bounds, not finite, or the
    /// first ones again.
    void move(std::uint64_t seed);

private:
    void set(std::size_t vertex, const vec3& p);

    std::vector<vec3> first_;
    std::vector<std::byte> bytes_;
    std::size_t stride_ = sizeof(vec3);
    std::size_t offset_ = 0;
    std::vector<uvec3> triangles_;
    std::vector<std::uint32_t> indices_;
    std::vector<std::uint32_t> albedo_;
    std::vector<std::uint32_t> smooth_;
    std::vector<std::vector<std::uint32_t>> texels_;
    std::vector<morphray::TextureView> textures_;
    std::vector<float> texcoords_;
    std::vector<std::uint32_t> texture_ids_;
    bool deforms_ = true;
    bool is_backdrop_ = false;
    bool is_smooth_by_vertex_ = false;
};

}  // namespace mray::fuzz
