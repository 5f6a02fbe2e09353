#include "gpu/packet_arguments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/interop/packet_bounds.h"

namespace mray::gpu {
namespace {

using Row = std::array<double, 3>;

Row cross(const vec3& p, const vec3& q) {
    return {double{p.y} * q.z - double{p.z} * q.y, double{p.z} * q.x - double{p.x} * q.z,
            double{p.x} * q.y - double{p.y} * q.x};
}

/// The rows that invert (du, dv, corner). Not finite if these lie in one plane.
std::array<Row, 3> frame_of(const Camera& camera) {
    std::array<Row, 3> rows = {cross(camera.dv, camera.corner), cross(camera.corner, camera.du),
                               cross(camera.du, camera.dv)};
    const double det =
        camera.du.x * rows[0][0] + camera.du.y * rows[0][1] + camera.du.z * rows[0][2];
    for (Row& row : rows)
        for (double& x : row) x /= det;
    return rows;
}

}  // namespace

std::uint32_t packet_lanes(const PhysicalDevice& device, const Tuning& tuning) {
    constexpr std::uint32_t kFewest = 4;
    if (!tuning.use_packets || !device.has_shuffle || !device.has_full_subgroups) return 0;
    // Clusters of a subgroup need lanes that stay together, which GPUs do not promise.
    if (device.info.type != "cpu") return 0;
    const std::uint32_t size = device.info.subgroup_size;
    if (size < kFewest) return 0;
    return std::min(size, tuning.most_packet_lanes);
}

std::uint32_t packet_run(const PhysicalDevice& device) {
    // On a CPU branches are masks, so longer runs pay, and a few threads use all cores.
    return device.info.type == "cpu" ? 4 : 1;
}

bool has_packet_frame(const ImageParams& params) {
    const Camera& camera = params.camera;
    const std::array<Row, 3> rows = frame_of(camera);
    // Each sum of find_ray_error() is at most 4 largest, or 1e-6 of it on another axis. A packet
    // may reach beyond the image by its own size.
    double largest = 0;
    double along = 0;
    bool is_finite = true;
    for (int axis = 0; axis < 3; ++axis) {
        const double across = std::abs(double{camera.du[axis]}) * (params.width + 16.0);
        const double down = std::abs(double{camera.dv[axis]}) * (params.height + 16.0);
        largest = std::max(largest, std::abs(double{camera.corner[axis]}) + across + down);
        along += std::abs(rows[2][axis]);
        for (const Row& row : rows)
            is_finite = is_finite && std::abs(row[axis]) < std::numeric_limits<float>::max();
    }
    return is_finite && 5 * kDirectionRounding * along * largest < 0x1p-8;
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
    const std::array<Row, 3> rows = frame_of(camera);
    float* const out[] = {arguments.row_x, arguments.row_y, arguments.row_z};
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t axis = 0; axis < 3; ++axis)
            out[k][axis] = static_cast<float>(rows[k][axis]);
    return arguments;
}

}  // namespace mray::gpu
