// Reads the caller's positions into scene space.
#pragma once

#include "common/base/thread_arena.h"
#include "common/scene/pose.h"
#include "common/scene/scene_space.h"
#include "common/simd/simd_target.h"
#include "cpu/scene_space/to_scene.h"
#include "library/src/scene/mesh_list.h"
#include "morphray/scene.hpp"

namespace morphray::detail {

/// The positions of all meshes, as they were last read, in world space and in scene space, and the
/// space, which is space_of_pose() of bounds and positions. Vertices that no triangle uses are
/// kInvalidCoordinate, as if they were not finite.
///
/// Another space cannot read positions again, since the caller may be writing to them. Scene space
/// gives them back but for very small coordinates and vertices that are left out. Meshes with such
/// are kept in world space as well.
class PoseReader {
public:
    /// `bounds` are in the caller's coordinates; nothing: those of the first positions.
    PoseReader(const std::optional<Box>& bounds, const Point& origin,
               const mray::SimdTarget& target);

    const mray::Origin& origin() const { return origin_; }
    const mray::SceneSpace& space() const { return space_; }
    /// The bounds that the space follows; empty before there is a position.
    const mray::WorldBounds& bounds() const { return bounds_; }
    /// In scene space, for backends. Its last move is the last read() or read_list().
    const mray::Pose& pose() const { return pose_; }
    std::span<const mray::vec3> positions() const { return pose_.positions(); }
    /// As it was read. The vertex is not left out.
    mray::vec3 world_position(std::uint32_t vertex) const;
    /// Whether scene space gives back all positions: it is an exact image of world space then.
    bool is_exact() const { return kept_.empty(); }

    /// The positions that are read next give the bounds.
    void forget_bounds() { bounds_ = {}; }
    /// Reads the positions of new and deforming meshes of a list whose changes have been made.
    void read_list(const MeshList& meshes, mray::ThreadArena& arena);
    /// Moves the pose to these vertices, and to another space if they need it.
    void read(const MeshList& meshes, std::span<const MeshVertices> vertices,
              mray::ThreadArena& arena);
    /// Counts the vertices that are left out, by meshes that have some.
    std::vector<LeftOut> left_out(const MeshList& meshes) const;

private:
    struct KeptPositions {
        std::vector<mray::vec3> world;
        bool any_left_out = false;
        std::uint64_t too_small = 0;
    };

    mray::cpu::MadePositions write(const mray::SceneSpace& space, std::size_t first,
                                   std::span<const mray::vec3> run);
    void read_of_mesh(const MeshVertices& range, mray::ThreadArena& arena);
    template <class Use>
    void for_each_world_run(const MeshSlot& mesh, std::size_t begin, std::size_t end,
                            Use use) const;
    std::uint64_t count_too_small(const MeshSlot& mesh, const mray::Topology& topology) const;
    void find_space(const MeshList& meshes, mray::ThreadArena& arena);
    void move_to(const mray::SceneSpace& space, const MeshList& meshes, mray::ThreadArena& arena);

    mray::Origin origin_;
    mray::WorldBounds bounds_;
    mray::SceneSpace space_;
    mray::SimdTarget target_;
    /// Whether a vertex lies outside the space of bounds_. The space is then that of the pose.
    bool is_extended_ = false;
    mray::Pose pose_;
    /// Meshes whose positions in world space pose_ does not give back, by first vertex.
    std::map<std::uint32_t, KeptPositions> kept_;
};

}  // namespace morphray::detail
