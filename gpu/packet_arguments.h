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

/// Whether packets can trace an image: its rays span space and have, in the frame of each
/// packet, a z above 0 that is known to 2^-7 (`e2` of find_ray_error() in
/// shaders/packet/camera_packet.comp). It is false for fields of view from some 179.98 degrees on,
/// and for those so small that all rays are the same.
bool has_packet_frame(const ImageParams& params);

/// The arguments of camera packets of `lanes` lanes over a region, tile_columns and tile_count
/// included, of an image that has_packet_frame().
PacketArguments packet_arguments(const RegionArguments& region, std::uint32_t lanes);

}  // namespace mray::gpu
