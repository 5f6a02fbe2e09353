// Camera rays as packets: whether, and with which arguments.
#pragma once

#include <cstdint>

#include "gpu/tuning.h"
#include "gpu/vulkan/device_info.h"

namespace morphray::gpu {

/// Lanes of a packet on a device, a part of its subgroups; 0 where there can be no packets.
std::uint32_t packet_lanes(const PhysicalDevice& device, const Tuning& tuning);

/// How many packets a cluster of lanes traces, one after the other.
std::uint32_t packet_run(const PhysicalDevice& device);

/// For the rays of a region, tile_columns and tile_count included; packets are traced by `lanes`.
PacketArguments packet_arguments(const RegionArguments& region, std::uint32_t lanes);

}  // namespace morphray::gpu
