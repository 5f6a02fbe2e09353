// The structures that a driver builds over one mesh: triangles, and one instance of them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/scene/mesh.h"
#include "gpu/vulkan/buffer.h"
#include "gpu/vulkan/transfer.h"

namespace mray::gpu {

/// Buffers of a build: a structure, its memory, and scratch memory.
class Structure {
public:
    Structure() = default;
    /// Makes room for a structure of this geometry.
    Structure(Context& context, const char* name, VkAccelerationStructureTypeKHR type,
              const VkAccelerationStructureGeometryKHR& geometry, std::uint32_t primitives,
              VkBuildAccelerationStructureFlagsKHR flags);

    /// Records a build, or an update of what was built before.
    void record(VkCommandBuffer commands, bool is_update) const;

    VkAccelerationStructureKHR get() const { return structure_.get(); }
    VkDeviceAddress address() const { return address_; }
    /// Bytes of the structure itself.
    VkDeviceSize size() const { return memory_.size(); }

private:
    VkAccelerationStructureTypeKHR type_ = VK_ACCELERATION_STRUCTURE_TYPE_GENERIC_KHR;
    VkBuildAccelerationStructureFlagsKHR flags_ = 0;
    VkAccelerationStructureGeometryKHR geometry_ = {};
    std::uint32_t primitives_ = 0;
    Buffer memory_;
    Buffer scratch_;
    VkDeviceAddress scratch_address_ = 0;
    UniqueAccelerationStructure structure_;
    VkDeviceAddress address_ = 0;
};

/// A mesh on the device with its structures. Positions take 16 bytes, as those of our backend do.
class StructuredMesh {
public:
    /// Uploads the triangles and makes room for the structures. Throws Error(kLimit).
    StructuredMesh(Context& context, Transfer& transfer, const Topology& topology);

    std::size_t vertex_count() const { return positions_.vertices; }
    /// Writes positions; those at kInvalidCoordinate become NaN, which makes a triangle inactive.
    void upload(Transfer& transfer, std::span<const vec3> positions);
    /// Builds or updates both structures; the instance is always built. Returns milliseconds.
    double build(Context& context, bool is_update);
    /// The structure that rays are traced in.
    VkAccelerationStructureKHR top() const { return instance_.get(); }

private:
    struct Positions {
        std::size_t vertices = 0;
        Buffer buffer;
    };

    Positions positions_;
    Buffer indices_;
    Structure triangles_;
    Buffer instance_buffer_;
    Structure instance_;
    std::vector<vec3> written_;
};

}  // namespace mray::gpu
