#include "lab/bench/paper_2007/packet.h"

#include <algorithm>
#include <cmath>

#include "cpu/packet/light/light_packet.h"

namespace mray::bench::paper_2007 {
namespace {

constexpr int kBlocksPerTile = kTileSize / kBlockSize;
constexpr int kBlocksPerPacket = kPacketSide / kBlockSize;
static_assert(kBlockSize * kBlockSize == kLanes && kTileSize % kPacketSide == 0);

/// The group of a block of a tile.
std::size_t first_ray(int block_x, int block_y) {
    return cpu::light_packet_ray(static_cast<std::uint32_t>(block_x) * kBlockSize,
                                 static_cast<std::uint32_t>(block_y) * kBlockSize);
}

vec3 direction(const PacketRays& packet, int group, int lane) {
    return {packet.dir[0][group][lane], packet.dir[1][group][lane], packet.dir[2][group][lane]};
}

/// The corners of a rectangle around where the rays meet a plane across the axis that is largest in
/// their sum; none where a ray does not come through that plane.
void bound_by_corners(PacketRays& packet, const TraceWork& work) {
    std::vector<vec3> dirs;
    vec3 sum = {0, 0, 0};
    for (int group = 0; group < kGroups; ++group) {
        for (int lane = 0; lane < kLanes; ++lane) {
            if (work.active[packet.first_ray[group] + lane] == 0) continue;
            dirs.push_back(direction(packet, group, lane));
            sum += dirs.back();
        }
    }
    int z = 0;
    for (int axis = 1; axis < 3; ++axis) {
        if (std::fabs(sum[axis]) > std::fabs(sum[z])) z = axis;
    }
    const int x = (z + 1) % 3;
    const int y = (z + 2) % 3;
    const float side = sum[z] < 0 ? -1.0f : 1.0f;
    vec3 lower(INFINITY);
    vec3 upper(-INFINITY);
    packet.has_corners = false;
    for (const vec3& dir : dirs) {
        if (!(dir[z] * side > 0)) return;
        for (const int axis : {x, y}) {
            lower[axis] = std::min(lower[axis], dir[axis] / std::fabs(dir[z]));
            upper[axis] = std::max(upper[axis], dir[axis] / std::fabs(dir[z]));
        }
    }
    for (int i = 0; i < 4; ++i) {
        packet.corners[i][x] = i % 2 == 0 ? lower[x] : upper[x];
        packet.corners[i][y] = i < 2 ? lower[y] : upper[y];
        packet.corners[i][z] = side;
    }
    packet.has_corners = true;
}

}  // namespace

std::vector<PacketRays> make_packets(const TraceWork& work, const TileRays& tile) {
    std::vector<PacketRays> packets;
    for (int block_y = 0; block_y < kBlocksPerTile; block_y += kBlocksPerPacket) {
        for (int block_x = 0; block_x < kBlocksPerTile; block_x += kBlocksPerPacket) {
            PacketRays packet;
            bool any = false;
            for (int group = 0; group < kGroups; ++group) {
                packet.first_ray[group] =
                    tile.begin + first_ray(block_x + group % kBlocksPerPacket,
                                           block_y + group / kBlocksPerPacket);
                for (int lane = 0; lane < kLanes; ++lane) {
                    const std::size_t i = packet.first_ray[group] + lane;
                    const Ray& ray = work.rays[i];
                    for (int axis = 0; axis < 3; ++axis) {
                        packet.dir[axis][group][lane] = ray.dir[axis];
                    }
                    packet.tfar[group][lane] = work.active[i] != 0 ? ray.tfar : -1.0f;
                    if (work.active[i] != 0) packet.org = ray.org;
                    any = any || work.active[i] != 0;
                }
            }
            if (!any) continue;
            bound_by_corners(packet, work);
            packets.push_back(packet);
        }
    }
    return packets;
}

}  // namespace mray::bench::paper_2007
