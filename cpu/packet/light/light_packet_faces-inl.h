// Rays that spread too widely for one plane: a packet for each face of a cube around their origin.

#if defined(MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_FACES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_FACES_INL_H
#undef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_FACES_INL_H
#else
#define MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_FACES_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>
#include <span>

#include "cpu/packet/light/light_packet.h"
#include "cpu/packet/light/light_packet_maker-inl.h"
#include "cpu/packet/light/light_packet_regroup-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Faces are numbered by axis, first the one in its positive direction.
inline constexpr std::uint32_t kFaces = 6;

/// The active rays by face, and on a face by cell.
struct FaceOrder {
    std::uint16_t rays[kLightPacketRays];
    std::uint32_t begin[kFaces + 1];

    std::span<const std::uint16_t> of_face(std::uint32_t face) const {
        return std::span(rays).subspan(begin[face], begin[face + 1] - begin[face]);
    }
};

/// face * Cells::kCount + cell of some directions; that of (1, 0, 0) where not `on`.
HWY_INLINE UintVec cells_of_faces(const FloatVec dir[3], Mask on) {
    const FloatVec d[3] = {select(on, dir[0], splat(1.0f)), zero_unless(on, dir[1]),
                           zero_unless(on, dir[2])};
    const FloatVec size[3] = {abs(d[0]), abs(d[1]), abs(d[2])};
    const Mask is_x = (size[0] >= size[1]) & (size[0] >= size[2]);
    const Mask is_y = and_not(is_x, size[1] >= size[2]);
    const FloatVec largest = select(is_x, d[0], select(is_y, d[1], d[2]));
    const FloatVec scale = splat(1.0f) / abs(largest);
    const FloatVec x = select(is_x, d[1], d[0]) * scale;
    const FloatVec y = select(is_x | is_y, d[2], d[1]) * scale;
    const UintVec axis =
        select(uint_mask(is_x), splat(0u), select(uint_mask(is_y), splat(2u), splat(4u)));
    const UintVec negative = select(uint_mask(largest < zero()), splat(1u), splat(0u));
    constexpr float kHalfSide = 0.5f * Cells::kPerSide;
    const Cells cells = {-1, -1, kHalfSide, kHalfSide};
    static_assert(Cells::kCount == 256);
    return shift_left<8>(axis | negative) | cells.of(x, y);
}

/// Sorts the active rays of some blocks by face and cell.
HWY_INLINE void sort_by_face(const SharedOriginRays* rays, std::uint32_t block_count,
                             FaceOrder& order) {
    std::uint16_t keys[kLightPacketRays];
    std::uint16_t active[kLightPacketRays];
    // The place of the next ray of each cell.
    std::uint16_t next[kFaces * Cells::kCount + 1] = {};
    std::size_t count = 0;
    for (std::uint32_t block = 0; block < block_count; ++block) {
        for (std::uint32_t l = 0; l < kBlockRays; l += kLanes) {
            FloatVec dir[3], tfar;
            load_rays(rays[block], l, dir, tfar);
            alignas(64) std::uint32_t own[kLanes];
            store(cells_of_faces(dir, tfar >= zero()), own);
            for (std::uint32_t i = 0; i < kLanes; ++i) {
                const bool is_active = rays[block].has(l + i);
                keys[count] = static_cast<std::uint16_t>(own[i]);
                active[count] = static_cast<std::uint16_t>(block * kBlockRays + l + i);
                next[own[i] + 1] = static_cast<std::uint16_t>(next[own[i] + 1] + is_active);
                count += is_active;
            }
        }
    }
    for (std::uint32_t key = 1; key <= kFaces * Cells::kCount; ++key)
        next[key] = static_cast<std::uint16_t>(next[key] + next[key - 1]);
    for (std::uint32_t face = 0; face <= kFaces; ++face)
        order.begin[face] = next[face * Cells::kCount];
    for (std::size_t i = 0; i < count; ++i) order.rays[next[keys[i]]++] = active[i];
}

/// Makes a packet of the rays of a face, all of them in regrouped blocks. Returns false, which no
/// canonical direction does, if they do not fit its plane.
HWY_INLINE bool make_face_packet(vec3 org, const SharedOriginRays* rays, std::uint32_t face,
                                 std::span<const std::uint16_t> of_face, LightPacket& packet) {
    const std::uint32_t axis = face / 2;
    double axes[3][3] = {};
    axes[0][(axis + 1) % 3] = axes[1][(axis + 2) % 3] = 1;
    axes[2][axis] = face % 2 == 0 ? 1 : -1;
    float centre[3] = {};
    centre[axis] = face % 2 == 0 ? 1 : -1;
    // |x / z| and |y / z| are at most 1.
    const double unit = plane_unit(1);
    packet.square_count = 0;
    packet.rays = rays;
    FloatVec least_z = splat(kEmptyLower);
    make_regrouped_blocks(NearDirections(axes, centre, 1 / unit), of_face, packet, least_z);
    return least_lane(least_z) > kLeastZ && set_plane(org, axes, unit, packet);
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
