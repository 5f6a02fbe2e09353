// Sizes and arguments of packets for a device.
#pragma once

#include <cstdint>

#include "gpu/vulkan/device_info.h"
#include "gpu/vulkan/tuning.h"

namespace mray::gpu {

/// Lanes of a packet, a part of the device's subgroups; 0 if the device cannot trace packets.
std::uint32_t packet_lanes(const PhysicalDevice& device, const Tuning& tuning);

/// The number of packets that a cluster of lanes traces one after the other.
std::uint32_t packet_run(const PhysicalDevice& device);

/// The arguments of camera packets of `lanes` lanes over a region, tile_columns and tile_count
/// included.
PacketArguments packet_arguments(const RegionArguments& region, std::uint32_t lanes);

}  // namespace mray::gpu
