// rtcInterpolate: attributes of vertices at places on triangles and quads.
#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "library/embree/device.h"
#include "library/embree/geometry.h"
#include "library/embree/scene/parts.h"

namespace mray::embree {
namespace {

/// A triangle of a primitive: its corners, its own u and v of the place, and the sign of both
/// against those of the primitive.
struct Place {
    std::array<const float*, 3> corners;
    float u;
    float v;
    float sign;
};

Place find_place(const Geometry& geometry, const BufferView& values, unsigned int prim_id, float u,
                 float v) {
    if (prim_id >= geometry.prim_count()) fail_argument("there is no such primitive");
    Part part;
    part.vertices.count = values.count;
    part.indices = geometry.indices();
    part.is_quads = geometry.is_quads();
    // The second triangle of a quad begins at the opposite corner.
    const bool is_second = part.is_quads && u + v > 1;
    const std::size_t triangle =
        part.is_quads ? 2 * std::size_t{prim_id} + (is_second ? 1 : 0) : prim_id;
    std::array<std::uint32_t, 3> corners;
    if (!part.find_corners(triangle, corners))
        fail_argument("the primitive has an index out of range");
    Place place;
    for (std::size_t i = 0; i < 3; ++i) place.corners[i] = values.at<float>(corners[i]);
    place.u = is_second ? 1 - u : u;
    place.v = is_second ? 1 - v : v;
    place.sign = is_second ? -1.0f : 1.0f;
    return place;
}

void interpolate(const RTCInterpolateArguments& asked) {
    const auto& geometry = *reinterpret_cast<const Geometry*>(asked.geometry);
    if (const char* const type = geometry.unsupported()) fail_unsupported(type);
    const BufferView* const values = geometry.find_buffer(asked.bufferType, asked.bufferSlot);
    if (values == nullptr || values->data == nullptr)
        fail_argument("the geometry has no such buffer");
    const Place at = find_place(geometry, *values, asked.primID, asked.u, asked.v);
    const auto [a, b, c] = at.corners;
    const float w = 1 - at.u - at.v;
    for (unsigned int i = 0; i < asked.valueCount; ++i) {
        if (asked.P != nullptr) asked.P[i] = w * a[i] + at.u * b[i] + at.v * c[i];
        if (asked.dPdu != nullptr) asked.dPdu[i] = at.sign * (b[i] - a[i]);
        if (asked.dPdv != nullptr) asked.dPdv[i] = at.sign * (c[i] - a[i]);
        for (float* const zero : {asked.ddPdudu, asked.ddPdvdv, asked.ddPdudv})
            if (zero != nullptr) zero[i] = 0;
    }
}

}  // namespace
}  // namespace mray::embree

using namespace mray::embree;

void rtcInterpolate(const struct RTCInterpolateArguments* asked) {
    with<Geometry>("rtcInterpolate", asked == nullptr ? nullptr : asked->geometry,
                   [&](Geometry&) { interpolate(*asked); });
}

/// The results of value k of query i are at [k * N + i].
void rtcInterpolateN(const struct RTCInterpolateNArguments* asked) {
    with<Geometry>("rtcInterpolateN", asked == nullptr ? nullptr : asked->geometry, [&](Geometry&) {
        float* const outs[] = {asked->P,       asked->dPdu,    asked->dPdv,
                               asked->ddPdudu, asked->ddPdvdv, asked->ddPdudv};
        const std::size_t count = asked->valueCount;
        std::vector<float> found(6 * count);
        const auto values_of = [&](std::size_t out) { return found.data() + out * count; };
        for (unsigned int i = 0; i < asked->N; ++i) {
            const auto* const valid = static_cast<const int*>(asked->valid);
            if (valid != nullptr && valid[i] != -1) continue;
            interpolate({asked->geometry, asked->primIDs[i], asked->u[i], asked->v[i],
                         asked->bufferType, asked->bufferSlot, values_of(0), values_of(1),
                         values_of(2), values_of(3), values_of(4), values_of(5),
                         asked->valueCount});
            for (std::size_t out = 0; out < 6; ++out) {
                if (outs[out] == nullptr) continue;
                for (std::size_t k = 0; k < count; ++k)
                    outs[out][k * asked->N + i] = values_of(out)[k];
            }
        }
    });
}
