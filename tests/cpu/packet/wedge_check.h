// How far rays are outside the wedges of their packet.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/interop/ray.h"
#include "cpu/packet/packet_frame.h"

namespace mray::test {

/// The least n.d / |d| of a packet's wedge sides n and a ray's direction d, with the sum of
/// magnitudes for |d|; 0 if it is positive. A wedge that holds the ray has no less than what
/// roundings make of 0.
inline double least_inside_wedges(const cpu::PacketFrame& frame, const vec3& dir) {
    double least = 0;
    double size = 0;
    for (int axis = 0; axis < 3; ++axis) size += std::abs(double{dir[axis]});
    for (std::uint32_t k = 0; k < frame.wedge_side_count; ++k) {
        const cpu::WedgeSide& side = frame.wedge_sides[k];
        double inside = 0;
        for (int i = 0; i < 2; ++i)
            inside += double{side.normal[i]} * dir[static_cast<int>(side.axes[i])];
        least = std::min(least, inside / size);
    }
    return least;
}

}  // namespace mray::test
