#include "gpu/packet_arguments.h"

#include <algorithm>

namespace mray::gpu {
namespace {

using Row = double[3];

void cross(const vec3& p, const vec3& q, Row& out) {
    out[0] = double{p.y} * q.z - double{p.z} * q.y;
    out[1] = double{p.z} * q.x - double{p.x} * q.z;
    out[2] = double{p.x} * q.y - double{p.y} * q.x;
}

}  // namespace

std::uint32_t packet_lanes(const PhysicalDevice& device, const Tuning& tuning) {
    constexpr std::uint32_t kFewest = 4;
    if (!tuning.use_packets || !device.has_shuffle) return 0;
    const std::uint32_t size = device.info.subgroup_size;
    if (size < kFewest) return 0;
    return std::min(size, tuning.most_packet_lanes);
}

std::uint32_t packet_run(const PhysicalDevice& device) {
    // On a CPU branches are masks, so longer runs pay, and a few threads use all cores.
    return device.info.type == "cpu" ? 4 : 1;
}

PacketArguments packet_arguments(const RegionArguments& region, std::uint32_t lanes) {
    const std::uint32_t packet_height = lanes == 4 ? 8 : kCameraPacketHeight;
    const Camera& camera = region.params.camera;
    PacketArguments arguments = {};
    arguments.camera = camera;
    arguments.x = region.x;
    arguments.y = region.y;
    arguments.width = region.width;
    arguments.height = region.height;
    arguments.tile_columns = (region.width + kPacketWidth - 1) / kPacketWidth;
    arguments.tile_count =
        arguments.tile_columns * ((region.height + packet_height - 1) / packet_height);
    Row rows[3];
    cross(camera.dv, camera.corner, rows[0]);
    cross(camera.corner, camera.du, rows[1]);
    cross(camera.du, camera.dv, rows[2]);
    const double det =
        camera.du.x * rows[0][0] + camera.du.y * rows[0][1] + camera.du.z * rows[0][2];
    float* const out[] = {arguments.row_x, arguments.row_y, arguments.row_z};
    for (int k = 0; k < 3; ++k) {
        for (int axis = 0; axis < 3; ++axis) out[k][axis] = static_cast<float>(rows[k][axis] / det);
    }
    return arguments;
}

}  // namespace mray::gpu
