// The positions of a scene, what of them the last move changed, and which bodies have moved.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/interop/transform.h"
#include "common/scene/scene_space.h"

namespace mray {

/// Vertices are compared in blocks of this many: three cache lines. Smaller blocks gain nothing.
inline constexpr std::uint32_t kMotionBlock = 16;

/// Vertices that a matrix moves, for devices that move them themselves: first_vertex, ... lie at
/// space.to_scene(transform_point(transform, rest[i])). None is left out, and devices compute the
/// same bits.
struct Body {
    std::uint32_t first_vertex = 0;
    std::span<const vec3> rest = {};
    /// Differs for other rest positions of the same scene.
    std::uint64_t rest_version = 0;
    Transform transform = {};
    SceneSpace space;

    std::uint32_t end_vertex() const {
        return first_vertex + static_cast<std::uint32_t>(rest.size());
    }
};

/// True if devices, which may flush denormals, move points of 0 and normal floats to the positions
/// of the host (docs/design/arithmetic.md, "Bodies").
inline bool moves_alike_on_devices(const Transform& transform, const SceneSpace& space) {
    if (space.exponent() < -126 || space.exponent() > 33) return false;
    for (int axis = 0; axis < 3; ++axis)
        if (space.centre(axis) != 0 && std::abs(space.centre(axis)) < 0x1p-49) return false;
    for (const vec4& row : {transform.x, transform.y, transform.z}) {
        for (const float m : {row.x, row.y, row.z})
            if (m != 0 && !std::isnormal(m)) return false;
        if (row.w != 0 && std::abs(row.w) < 0x1p-49f) return false;
    }
    return true;
}

/// The positions of a scene in scene space, which backends borrow, and the blocks of vertices that
/// the last move changed.
class Pose {
public:
    /// No block has moved.
    explicit Pose(std::vector<vec3> positions = {})
        : positions_(std::move(positions)),
          moved_((positions_.size() + kMotionBlock - 1) / kMotionBlock) {}

    std::span<const vec3> positions() const { return positions_; }
    std::uint32_t block_count() const { return static_cast<std::uint32_t>(moved_.size()); }
    /// The blocks that moved since begin_move(), ascending; and their number.
    std::vector<std::uint32_t> moved_blocks() const;
    std::uint32_t moved_count() const;

    /// Begins a move: no block has moved.
    void begin_move() {
        std::ranges::fill(moved_, std::uint8_t{0});
        bodies_.clear();
    }
    /// Overwrites vertices first, first + 1, ...; blocks move if a vertex differs in any bit.
    /// Threads may write different vertices at the same time.
    void write(std::size_t first, std::span<const vec3> positions);
    /// Adds a body whose vertices have been written, unless none of its blocks has moved. Bodies
    /// come in ascending order of vertices; their rest positions must stay until the next move.
    void add_body(const Body& body);
    void forget_bodies() { bodies_.clear(); }
    /// The bodies of the last move.
    std::span<const Body> bodies() const { return bodies_; }
    /// Moves to as many positions, in the calling thread's arena.
    void move_to(std::span<const vec3> positions);

private:
    std::vector<vec3> positions_;
    std::vector<std::uint8_t> moved_;
    std::vector<Body> bodies_;
};

/// The indices of flags that are not 0, ascending.
std::vector<std::uint32_t> indices_of(const std::vector<std::uint8_t>& flags);

}  // namespace mray
