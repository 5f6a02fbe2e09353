// A scene on the device.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh.h"
#include "common/mesh.h"
#include "gpu/pipeline.h"
#include "gpu/transfer.h"

namespace morphray::gpu {

/// A buffer that kernels read as texels.
struct TexelBuffer {
    TexelBuffer() = default;
    TexelBuffer(Context& context, const char* name, VkDeviceSize size, VkFormat format,
                VkBufferUsageFlags usage = VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT);

    Buffer buffer;
    UniqueBufferView view;
};

/// Topology, positions and tree. Sizes have been checked (check_scene).
class SceneBuffers {
public:
    SceneBuffers(Context& context, Transfer& transfer, const Topology& topology,
                 std::span<const vec3> positions, const Bvh& bvh);

    std::uint32_t vertex_count() const { return vertex_count_; }
    std::uint32_t triangle_count() const { return triangle_count_; }
    std::uint32_t node_count() const { return level_begin_.back(); }
    std::uint32_t leaf_count() const { return leaf_count_; }
    /// As in Bvh.
    const std::vector<std::uint32_t>& level_begin() const { return level_begin_; }

    void set_positions(Transfer& transfer, std::span<const vec3> positions);
    /// Replaces the tree by one over the same triangles. Bindings have to be made anew.
    void set_tree(Context& context, Transfer& transfer, const Bvh& bvh);
    /// Reads nodes and leaves back.
    void read_tree(Transfer& transfer, Bvh& bvh) const;

    void add_to(Bindings& bindings) const;

private:
    std::uint32_t vertex_count_ = 0;
    std::uint32_t triangle_count_ = 0;
    std::uint32_t leaf_count_ = 0;
    std::vector<std::uint32_t> level_begin_;
    TexelBuffer positions_;
    TexelBuffer triangles_;
    TexelBuffer albedo_;
    TexelBuffer nodes_;
    TexelBuffer leaves_;
    TexelBuffer leaf_vertices_;
    TexelBuffer leaf_parents_;
    TexelBuffer node_parents_;
    UniqueBufferView nodes_out_;
    UniqueBufferView leaves_out_;
};

}  // namespace morphray::gpu
