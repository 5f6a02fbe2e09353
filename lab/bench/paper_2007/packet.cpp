#include "lab/bench/paper_2007/packet.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace mray::bench::paper_2007 {
namespace {

/// A rectangle around where the rays meet a plane across their main axis; none where one does not.
void bound_by_corners(PacketRays& packet, std::span<const vec3> dirs) {
    vec3 sum = {0, 0, 0};
    for (const vec3& dir : dirs) sum += dir;
    int z = 0;
    for (int axis = 1; axis < 3; ++axis) {
        if (std::fabs(sum[axis]) > std::fabs(sum[z])) z = axis;
    }
    const int x = (z + 1) % 3;
    const int y = (z + 2) % 3;
    const float side = sum[z] < 0 ? -1.0f : 1.0f;
    vec3 lower(INFINITY);
    vec3 upper(-INFINITY);
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

std::vector<PacketRays> make_packets(const TraceWork& work) {
    assert(work.rays.size() == work.tiles.size() * kTilePackets * kPacketRays);
    std::vector<PacketRays> packets(work.rays.size() / kPacketRays);
    std::vector<vec3> dirs;
    for (std::size_t i = 0; i < work.rays.size(); ++i) {
        PacketRays& packet = packets[i / kPacketRays];
        const std::size_t group = i % kPacketRays / kLanes;
        const std::size_t lane = i % kLanes;
        const Ray& ray = work.rays[i];
        for (int axis = 0; axis < 3; ++axis) packet.dir[axis][group][lane] = ray.dir[axis];
        packet.tfar[group][lane] = work.active[i] != 0 ? ray.tfar : -1.0f;
        if (work.active[i] != 0) {
            packet.org = ray.org;
            dirs.push_back(ray.dir);
        }
        if ((i + 1) % kPacketRays != 0) continue;
        packet.any = !dirs.empty();
        bound_by_corners(packet, dirs);
        dirs.clear();
    }
    return packets;
}

}  // namespace mray::bench::paper_2007
