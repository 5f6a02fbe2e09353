// A scene on the device, and its refit.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"
#include "common/scene/pose.h"
#include "common/scene/vertex_normals.h"
#include "common/update/refit_plan.h"
#include "gpu/kernels.h"

namespace mray::gpu {

Bvh empty_tree();

/// Topology, positions and tree. Sizes must have passed choose_buffers().
class SceneBuffers {
public:
    SceneBuffers(Device& device, BufferKind kind, Transfer& transfer, const Topology& topology,
                 std::span<const vec3> positions, const Bvh& bvh);

    BufferKind kind() const { return kind_; }
    std::uint32_t vertex_count() const { return vertex_count_; }
    std::uint32_t triangle_count() const { return triangle_count_; }
    std::uint32_t node_count() const { return tree_.level_begin.back(); }
    std::uint32_t leaf_count() const { return tree_.leaf_count; }
    const std::vector<RepeatedTriangle>& repeated() const { return tree_.repeated; }
    const std::vector<std::uint32_t>& level_begin() const { return tree_.level_begin; }

    void set_positions(Transfer& transfer, std::span<const vec3> positions);
    /// Sets ranges of the positions. Returns commands that kernels must wait for, or nothing if the
    /// host writes device memory. Call it again only after these have run or were dropped.
    Record set_positions(std::span<const vec3> positions, std::span<const IndexRange> ranges);
    /// Uploads the rest positions of bodies that are not there yet. Returns true if it has made
    /// buffers, so that kernels must be bound again.
    bool set_rest_positions(Transfer& transfer, std::span<const Body> bodies);
    /// Returns commands that set the positions of bodies, whose rest positions have been set.
    Record move_bodies(const Kernels& kernels, std::span<const Body> bodies) const;
    /// False where they may be more than the device holds.
    bool holds(const VertexNormals& normals) const {
        return normals.normals().size() <= std::max(vertex_count_, triangle_count_);
    }
    /// Uploads normals that are held, unless they are there. Returns true if it has made buffers,
    /// so that kernels must be bound again.
    bool set_normals(Transfer& transfer, const VertexNormals& normals);
    /// Replaces the tree by one over the same triangles, or throws. Kernels must be bound again,
    /// and a refit of all must follow, which makes the boxes of quarters and groups.
    void set_tree(Transfer& transfer, const Bvh& bvh);
    /// Reads nodes and leaves back, into a tree that has as many.
    void read_tree(Transfer& transfer, Bvh& bvh) const;
    /// The nodes where the host sees them, or in `copy`. Valid until the tree changes.
    std::span<const Node> nodes(Transfer& transfer, AlignedVector<Node>& copy) const;

    void add_to(Bindings& bindings) const;

private:
    struct Tree {
        Tree(Device& device, BufferKind kind, Transfer& transfer, const Bvh& bvh);

        std::uint32_t leaf_count;
        std::vector<std::uint32_t> level_begin;
        ReadBuffer nodes;
        ReadBuffer leaves;
        /// The boxes of quarters of nodes and of groups of triangles (kernel_interface.h).
        ReadBuffer quarters;
        ReadBuffer groups;
        ReadBuffer leaf_vertices;
        ReadBuffer leaf_parents;
        ReadBuffer node_parents;
        std::vector<RepeatedTriangle> repeated;
        ReadBuffer repeated_texels;
    };

    /// Positions of vertices first, first + 1, ...
    struct VertexRun {
        std::uint32_t first;
        std::span<const vec3> positions;
    };
    bool make_room(ReadBuffer& buffer, const char* name, std::size_t size);
    Record set_vertices(const Buffer& to, Buffer& staged, std::span<const VertexRun> runs);

    Device* device_;
    BufferKind kind_;
    std::uint32_t vertex_count_ = 0;
    std::uint32_t triangle_count_ = 0;
    ReadBuffer positions_;
    /// Positions for copies, if the host does not see the device's memory.
    Buffer staged_positions_;
    /// Made for the first bodies: rest positions, their versions by first vertex, and records.
    ReadBuffer rest_positions_;
    std::map<std::uint32_t, std::uint64_t> rest_versions_;
    ReadBuffer bodies_;
    ReadBuffer triangles_;
    /// Made for the first lit image of smooth surfaces.
    ReadBuffer normals_;
    ReadBuffer normal_ids_;
    std::uint64_t normals_version_ = 0;
    Tree tree_;
};

/// The positions that a refit sends: ranges to copy, then bodies that the device moves.
struct PositionUpdate {
    std::vector<IndexRange> copied = {};
    std::span<const Body> bodies = {};
};
PositionUpdate all_positions(const Pose& pose);
/// For a device that has the positions before the last move of the pose.
PositionUpdate moved_positions(const Context& context, const Pose& pose);

/// Sets positions. Returns commands that refit the present scene by the plan and may write the same
/// bytes to further leaves and nodes, or nothing.
Record refit_scene(const Context& context, const Kernels& kernels, SceneBuffers& scene,
                   const PositionUpdate& update, const Pose& pose, const RefitPlan& plan);

}  // namespace mray::gpu
