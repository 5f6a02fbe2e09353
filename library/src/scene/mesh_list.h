// The meshes of a scene, as one topology and one sequence of vertices.
#pragma once

#include <cstring>
#include <map>
#include <optional>

#include "common/interop/transform.h"
#include "common/scene/mesh.h"
#include "cpu/image/texture.h"
#include "morphray/mesh.hpp"

namespace morphray::detail {

/// Position i, which may lie at any address.
inline glm::dvec3 load(const Positions& positions, std::size_t i) {
    const auto* const from = static_cast<const std::byte*>(positions.data) + i * positions.stride;
    if (positions.has_doubles) {
        glm::dvec3 p;
        std::memcpy(&p, from, sizeof(p));
        return p;
    }
    mray::vec3 p;
    std::memcpy(&p, from, sizeof(p));
    return p;
}

/// One mesh of the list. Its vertices and triangles are consecutive in the topology.
struct MeshSlot {
    bool used = false;
    Positions positions;
    bool deforms = true;
    /// If it is set, vertex i is at transform_point(*transform, rest[i]).
    std::optional<mray::Transform> transform = {};
    std::vector<mray::vec3> rest = {};
    /// Differs for other rest positions. They may be denormal or not finite unless
    /// `rest_is_normal`.
    std::uint64_t rest_version = 0;
    bool rest_is_normal = true;
    /// Whether triangles share the normals of their vertices, or normals with the numbers `smooth`.
    bool is_smooth = false;
    std::shared_ptr<const std::vector<mray::uvec3>> smooth = nullptr;
    std::vector<std::shared_ptr<const mray::cpu::Texture>> textures = {};
    std::uint32_t first_texture = 0;
    std::uint32_t first_vertex = 0;
    std::uint32_t first_prim = 0;
    std::uint32_t prim_count = 0;
    /// The vertices that its triangles use, counted from its first one.
    std::shared_ptr<const std::vector<mray::IndexRange>> used_vertices = nullptr;
    /// Its first vertex before the last changes were made; nothing for a mesh that came with them.
    std::optional<std::uint32_t> vertex_before = {};

    std::uint32_t vertex_count() const { return static_cast<std::uint32_t>(positions.count); }
    /// True if each update reads the positions.
    bool follows_positions() const { return used && deforms && !transform; }

    /// Calls visit(begin, end) for ranges of the used vertices of [begin, end).
    template <class Visit>
    void for_each_used(std::size_t begin, std::size_t end, Visit visit) const {
        const auto from =
            std::ranges::upper_bound(*used_vertices, begin, {}, &mray::IndexRange::end);
        for (auto range = from; range != used_vertices->end() && range->begin < end; ++range)
            visit(std::max<std::size_t>(range->begin, begin),
                  std::min<std::size_t>(range->end, end));
    }
};

struct MeshVertices {
    const MeshSlot* mesh;
    std::size_t first;
    std::size_t count;
};

/// The meshes in the order of their geom_ids. attach() and detach() collect changes.
class MeshList {
public:
    /// Returns the geom_id: the lowest one that is free. Throws Error.
    std::uint32_t attach(const MeshView& mesh);
    void detach(std::uint32_t geom_id);
    /// Throws Error, and changes nothing, if the positions do not fit.
    void set_positions(std::uint32_t geom_id, const Positions& positions);
    /// The first call for a mesh reads its rest positions.
    void set_transform(std::uint32_t geom_id, const mray::Transform& transform);
    /// Reads rest positions of a mesh with a transform again.
    void read_rest(std::uint32_t geom_id, std::size_t first, std::size_t count);
    bool has_changes() const { return !changes_.empty(); }
    /// Makes the collected changes. Too many positions or triangles together throw Error(limit),
    /// after which the list is of no use any more.
    void make_changes();

    const mray::Topology& topology() const { return topology_; }
    bool is_smooth() const {
        return std::ranges::any_of(slots_, [](auto& mesh) { return mesh.used && mesh.is_smooth; });
    }
    /// Three indices of vertex normals for each triangle, or mray::kFlatCorner. O(triangles).
    std::vector<mray::uvec3> normal_ids() const;
    mray::cpu::TexturedTriangles textures() const {
        return {.textures = textures_, .texcoords = texcoords_, .ids = texture_ids_};
    }
    bool has_alpha_test() const {
        return std::ranges::any_of(textures_, [](auto& image) { return image->has_alpha_test(); });
    }
    std::span<const MeshSlot> slots() const { return slots_; }
    /// All vertices of the meshes whose positions each update reads.
    std::vector<MeshVertices> deforming_vertices() const {
        std::vector<MeshVertices> all;
        for (const MeshSlot& mesh : slots_)
            if (mesh.follows_positions()) all.push_back({&mesh, 0, mesh.positions.count});
        return all;
    }
    /// Null for a geom_id that is free or whose attach() is only collected.
    const MeshSlot* find(std::uint32_t geom_id) const;

    Hit locate(float t, float u, float v, std::uint32_t prim_id) const {
        std::size_t i = 0;
        // Without branches: neighbours are of different meshes.
        for (std::size_t count = first_prims_.size(); count > 1; count -= count / 2)
            i += first_prims_[i + count / 2] <= prim_id ? count / 2 : 0;
        return {t, u, v, prim_id - first_prims_[i], geometry_ids_[i]};
    }

    /// Of meshes with triangles, ascending.
    std::span<const std::uint32_t> first_prims() const { return first_prims_; }
    /// The number of triangles of the topology up to (geom_id, prim_id), which need not exist.
    std::uint32_t count_up_to(std::uint32_t geom_id, std::uint32_t prim_id) const;

private:
    /// The mesh that a geom_id will have, and its arrays, which are empty after detach().
    struct Change {
        MeshSlot slot = {};
        std::vector<mray::uvec3> triangles = {};
        std::vector<mray::Albedo> albedo = {};
        std::vector<mray::Texcoords> texcoords = {};
        std::vector<std::uint32_t> texture_ids = {};
    };

    /// By geom_id.
    std::vector<MeshSlot> slots_;
    /// geom_ids in use with triangles, ascending, and the first_prim of each.
    std::vector<std::uint32_t> geometry_ids_;
    std::vector<std::uint32_t> first_prims_;
    mray::Topology topology_;
    std::vector<std::shared_ptr<const mray::cpu::Texture>> textures_;
    /// For each triangle, if a mesh has textures.
    std::vector<mray::Texcoords> texcoords_;
    std::vector<std::uint32_t> texture_ids_;
    std::map<std::uint32_t, Change> changes_;
    std::uint64_t last_rest_version_ = 0;
    /// The geom_ids that are in use once the changes are made. All below first_free_ are.
    std::vector<bool> will_be_used_;
    std::uint32_t first_free_ = 0;
};

}  // namespace morphray::detail
