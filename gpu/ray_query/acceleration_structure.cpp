#include "gpu/ray_query/acceleration_structure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <limits>

#include "common/base/errors.h"
#include "common/interop/constants.h"
#include "gpu/vulkan/result.h"

namespace mray::gpu {
namespace {

constexpr VkBufferUsageFlags kInput =
    VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_BIT_KHR |
    VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
constexpr VkBufferUsageFlags kStructure = VK_BUFFER_USAGE_ACCELERATION_STRUCTURE_STORAGE_BIT_KHR |
                                          VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
constexpr VkBufferUsageFlags kScratch =
    VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
constexpr VkPipelineStageFlags kBuildStage = VK_PIPELINE_STAGE_ACCELERATION_STRUCTURE_BUILD_BIT_KHR;
constexpr VkAccessFlags kBuildReads =
    VK_ACCESS_ACCELERATION_STRUCTURE_READ_BIT_KHR | VK_ACCESS_SHADER_READ_BIT;
constexpr VkAccessFlags kBuildWrites = VK_ACCESS_ACCELERATION_STRUCTURE_WRITE_BIT_KHR;

VkDeviceAddress address_of(Context& context, const Buffer& buffer) {
    const VkBufferDeviceAddressInfo info = {.sType = VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO,
                                            .buffer = buffer.get()};
    return vkGetBufferDeviceAddress(context.device(), &info);
}

VkPhysicalDeviceAccelerationStructurePropertiesKHR properties_of(Context& context) {
    VkPhysicalDeviceAccelerationStructurePropertiesKHR structures = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_PROPERTIES_KHR};
    VkPhysicalDeviceProperties2 properties = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2, .pNext = &structures};
    vkGetPhysicalDeviceProperties2(context.physical().handle, &properties);
    return structures;
}

VkAccelerationStructureGeometryKHR triangles_in(Context& context, const Buffer& positions,
                                                std::size_t vertices, const Buffer& indices) {
    return {
        .sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR,
        .geometryType = VK_GEOMETRY_TYPE_TRIANGLES_KHR,
        .geometry =
            {.triangles = {.sType =
                               VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_TRIANGLES_DATA_KHR,
                           .vertexFormat = VK_FORMAT_R32G32B32_SFLOAT,
                           .vertexData = {.deviceAddress = address_of(context, positions)},
                           .vertexStride = kPaddedBytes,
                           .maxVertex =
                               static_cast<std::uint32_t>(std::max<std::size_t>(vertices, 1) - 1),
                           .indexType = VK_INDEX_TYPE_UINT32,
                           .indexData = {.deviceAddress = address_of(context, indices)}}},
        // A triangle that a query offers twice is then an error of the driver.
        .flags = VK_GEOMETRY_NO_DUPLICATE_ANY_HIT_INVOCATION_BIT_KHR,
    };
}

VkAccelerationStructureGeometryKHR instances_in(Context& context, const Buffer& instances) {
    return {
        .sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_KHR,
        .geometryType = VK_GEOMETRY_TYPE_INSTANCES_KHR,
        .geometry =
            {.instances = {.sType =
                               VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_GEOMETRY_INSTANCES_DATA_KHR,
                           .data = {.deviceAddress = address_of(context, instances)}}},
    };
}

VkDeviceSize rounded_up(VkDeviceSize value, VkDeviceSize multiple) {
    return (value + multiple - 1) / multiple * multiple;
}

bool is_invalid(const vec3& p) {
    return p.x == kInvalidCoordinate && p.y == kInvalidCoordinate && p.z == kInvalidCoordinate;
}

void check_size(Context& context, const Topology& topology) {
    const std::uint64_t most = properties_of(context).maxPrimitiveCount;
    if (topology.triangles.size() <= most) return;
    throw Error(ErrorKind::kLimit,
                fmt::format("ray-query: the scene has {} triangles, the device's "
                            "structures hold {}; use a smaller scene",
                            topology.triangles.size(), most));
}

}  // namespace

Structure::Structure(Context& context, const char* name, VkAccelerationStructureTypeKHR type,
                     const VkAccelerationStructureGeometryKHR& geometry, std::uint32_t primitives,
                     VkBuildAccelerationStructureFlagsKHR flags)
    : type_(type), flags_(flags), geometry_(geometry), primitives_(primitives) {
    const VkAccelerationStructureBuildGeometryInfoKHR build = {
        .sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR,
        .type = type,
        .flags = flags,
        .mode = VK_BUILD_ACCELERATION_STRUCTURE_MODE_BUILD_KHR,
        .geometryCount = 1,
        .pGeometries = &geometry_,
    };
    VkAccelerationStructureBuildSizesInfoKHR sizes = {
        .sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_SIZES_INFO_KHR};
    vkGetAccelerationStructureBuildSizesKHR(context.device(),
                                            VK_ACCELERATION_STRUCTURE_BUILD_TYPE_DEVICE_KHR, &build,
                                            &primitives_, &sizes);
    memory_ = Buffer(context, name, sizes.accelerationStructureSize, kStructure, Memory::kDevice);
    const VkDeviceSize alignment = std::max<VkDeviceSize>(
        1, properties_of(context).minAccelerationStructureScratchOffsetAlignment);
    const VkDeviceSize scratch = std::max(sizes.buildScratchSize, sizes.updateScratchSize);
    scratch_ = Buffer(context, fmt::format("scratch of {}", name), scratch + alignment, kScratch,
                      Memory::kDevice);
    scratch_address_ = rounded_up(address_of(context, scratch_), alignment);

    const VkAccelerationStructureCreateInfoKHR info = {
        .sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_CREATE_INFO_KHR,
        .buffer = memory_.get(),
        .size = sizes.accelerationStructureSize,
        .type = type,
    };
    VkAccelerationStructureKHR structure = VK_NULL_HANDLE;
    check(vkCreateAccelerationStructureKHR(context.device(), &info, nullptr, &structure),
          "create an acceleration structure");
    structure_ = UniqueAccelerationStructure(context.device(), structure);
    context.name(VK_OBJECT_TYPE_ACCELERATION_STRUCTURE_KHR, structure, name);
    const VkAccelerationStructureDeviceAddressInfoKHR addressed = {
        .sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_DEVICE_ADDRESS_INFO_KHR,
        .accelerationStructure = structure,
    };
    address_ = vkGetAccelerationStructureDeviceAddressKHR(context.device(), &addressed);
}

void Structure::record(VkCommandBuffer commands, bool is_update) const {
    const VkAccelerationStructureBuildGeometryInfoKHR build = {
        .sType = VK_STRUCTURE_TYPE_ACCELERATION_STRUCTURE_BUILD_GEOMETRY_INFO_KHR,
        .type = type_,
        .flags = flags_,
        .mode = is_update ? VK_BUILD_ACCELERATION_STRUCTURE_MODE_UPDATE_KHR
                          : VK_BUILD_ACCELERATION_STRUCTURE_MODE_BUILD_KHR,
        .srcAccelerationStructure = is_update ? structure_.get() : VK_NULL_HANDLE,
        .dstAccelerationStructure = structure_.get(),
        .geometryCount = 1,
        .pGeometries = &geometry_,
        .scratchData = {.deviceAddress = scratch_address_},
    };
    const VkAccelerationStructureBuildRangeInfoKHR range = {.primitiveCount = primitives_};
    const VkAccelerationStructureBuildRangeInfoKHR* const ranges = &range;
    vkCmdBuildAccelerationStructuresKHR(commands, 1, &build, &ranges);
}

StructuredMesh::StructuredMesh(Context& context, Transfer& transfer, const Topology& topology) {
    check_size(context, topology);
    const auto triangles = static_cast<std::uint32_t>(topology.triangles.size());
    positions_ = {topology.vertex_count,
                  Buffer(context, "positions of structures", kPaddedBytes * topology.vertex_count,
                         kInput, Memory::kDevice)};
    indices_ = Buffer(context, "indices of structures", sizeof(uvec3) * triangles, kInput,
                      Memory::kDevice);
    transfer.upload(std::as_bytes(std::span(topology.triangles)), indices_);
    triangles_ = Structure(
        context, "triangles", VK_ACCELERATION_STRUCTURE_TYPE_BOTTOM_LEVEL_KHR,
        triangles_in(context, positions_.buffer, topology.vertex_count, indices_), triangles,
        VK_BUILD_ACCELERATION_STRUCTURE_ALLOW_UPDATE_BIT_KHR |
            VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR);
    const VkAccelerationStructureInstanceKHR instance = {
        .transform = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}},
        .mask = 0xFF,
        .flags = VK_GEOMETRY_INSTANCE_TRIANGLE_FACING_CULL_DISABLE_BIT_KHR,
        .accelerationStructureReference = triangles_.address(),
    };
    instance_buffer_ = Buffer(context, "instance", sizeof(instance), kInput, Memory::kDevice);
    transfer.upload(std::as_bytes(std::span(&instance, 1)), instance_buffer_);
    instance_ = Structure(context, "instances", VK_ACCELERATION_STRUCTURE_TYPE_TOP_LEVEL_KHR,
                          instances_in(context, instance_buffer_), 1,
                          VK_BUILD_ACCELERATION_STRUCTURE_PREFER_FAST_TRACE_BIT_KHR);
}

void StructuredMesh::upload(Transfer& transfer, std::span<const vec3> positions) {
    assert(positions.size() == positions_.vertices);
    const vec3 inactive(std::numeric_limits<float>::quiet_NaN());
    written_.assign(positions.begin(), positions.end());
    std::ranges::replace_if(written_, is_invalid, inactive);
    transfer.upload_padded(written_, positions_.buffer);
}

double StructuredMesh::build(Context& context, bool is_update) {
    return context.submit(
        is_update ? "update a structure" : "build a structure", [&](VkCommandBuffer commands) {
            // Writer: copies of positions, triangles and the instance, and the last build; reader:
            // this build. The last rays were waited for.
            barrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT | kBuildStage,
                    VK_ACCESS_TRANSFER_WRITE_BIT | kBuildWrites, kBuildStage,
                    kBuildReads | kBuildWrites);
            triangles_.record(commands, is_update);
            // Writer: the build of triangles; reader: that of the instance.
            barrier(commands, kBuildStage, kBuildWrites, kBuildStage, kBuildReads);
            instance_.record(commands, false);
            // Writer: both builds; reader: queries of later submissions.
            barrier(commands, kBuildStage, kBuildWrites, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                    VK_ACCESS_ACCELERATION_STRUCTURE_READ_BIT_KHR);
        });
}

}  // namespace mray::gpu
