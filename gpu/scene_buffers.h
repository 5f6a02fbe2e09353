// A scene on the device.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"
#include "common/update/refit_plan.h"
#include "gpu/keyframe_slots.h"
#include "gpu/position_ring.h"
#include "gpu/texel_buffer.h"
#include "gpu/vulkan/pipeline.h"
#include "gpu/vulkan/transfer.h"

namespace morphray::gpu {

/// A tree over no triangles.
Bvh empty_tree();

/// Topology, positions and tree. Sizes have been checked (check_scene).
class SceneBuffers {
public:
    SceneBuffers(Context& context, Transfer& transfer, const Topology& topology,
                 std::span<const vec3> positions, const Bvh& bvh);

    std::uint32_t vertex_count() const { return vertex_count_; }
    std::uint32_t triangle_count() const { return triangle_count_; }
    std::uint32_t node_count() const { return tree_.level_begin.back(); }
    std::uint32_t leaf_count() const { return tree_.leaf_count; }
    /// As in Bvh.
    const std::vector<std::uint32_t>& level_begin() const { return tree_.level_begin; }

    void set_positions(Transfer& transfer, std::span<const vec3> positions);
    /// Those of some ranges of the positions. Returns what has to be recorded before kernels see
    /// them, if anything. What is under way still sees those before.
    Record set_positions(Context& context, std::span<const vec3> positions,
                         std::span<const IndexRange> ranges);
    /// Whether the host writes positions where the device reads them.
    bool positions_are_mapped() const { return !positions_.buffer.mapped().empty(); }
    /// Room for keyframes, and what `deform` writes, which not every scene has (fits_keyframes):
    /// null until they are made. Bindings have to be made anew.
    KeyframeSlots* keyframes() { return keyframes_ ? &*keyframes_ : nullptr; }
    void make_keyframes(Context& context);
    /// Replaces the tree by one over the same triangles, with room to grow by a part of itself.
    /// Bindings have to be made anew. After an exception the old tree is still there.
    void set_tree(Context& context, Transfer& transfer, const Bvh& bvh, double room = 0);
    /// Likewise, where the tree that is there is `before`: writes what differs, if there is room
    /// for it, and no bindings have to be made. Returns the bytes that it wrote; nothing if there
    /// is no room, and then nothing has been done. After an exception the tree is of no use.
    std::optional<std::uint64_t> change_tree(Transfer& transfer, const Bvh& before,
                                             const Bvh& after);
    /// Of nodes, leaves and what belongs to them.
    std::uint64_t tree_bytes() const;
    /// Reads nodes and leaves back.
    void read_tree(Transfer& transfer, Bvh& bvh) const;
    AlignedVector<Node> read_nodes(Transfer& transfer) const;

    void add_to(Bindings& bindings) const;

private:
    struct Tree {
        Tree(Context& context, Transfer& transfer, const Bvh& bvh, double room);

        std::uint32_t leaf_count;
        std::vector<std::uint32_t> level_begin;
        TexelBuffer nodes;
        TexelBuffer leaves;
        TexelBuffer leaf_vertices;
        TexelBuffer leaf_parents;
        TexelBuffer node_parents;
        UniqueBufferView nodes_out;
        UniqueBufferView leaves_out;
    };

    std::uint32_t vertex_count_ = 0;
    std::uint32_t triangle_count_ = 0;
    TexelBuffer positions_;
    PositionRing ring_;
    UniqueBufferView positions_out_;
    std::optional<KeyframeSlots> keyframes_;
    TexelBuffer triangles_;
    Tree tree_;
};

}  // namespace morphray::gpu
