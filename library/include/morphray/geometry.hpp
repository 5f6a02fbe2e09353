// Points, boxes, rays and hits in world space: the caller's units and axes.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

namespace morphray {

struct Vec3 {
    float x = 0;
    float y = 0;
    float z = 0;
    bool operator==(const Vec3&) const = default;
};

/// x, y and z.
using Point = std::array<double, 3>;

/// All points p with lower <= p <= upper on each axis. A box with lower > upper is empty.
struct Box {
    Point lower = {0, 0, 0};
    Point upper = {0, 0, 0};
    bool operator==(const Box&) const = default;
};

/// The points org + t * dir with t > 0 and tnear <= t <= tfar: both ends belong to the ray, its
/// origin does not. `dir` has any length but 0; t is in units of it. 32 bytes, in the order of the
/// members, so that an array of 8 floats a ray may be read as rays.
///
/// A ray that starts on a triangle may hit it at a t next to 0, by rounding. QueryOptions::excluded
/// leaves that triangle out.
///
/// A ray hits nothing if a number in it is NaN, if org or dir is infinite, if dir is 0, or if no t
/// is left (tnear > tfar or tfar <= 0). A negative tnear counts as 0. org may be at any distance:
/// from some 500 scene sizes on, hits are those of the ray as it is near the scene, with t rounded
/// once.
struct Ray {
    Vec3 org;
    float tnear = 0;
    Vec3 dir;
    float tfar = std::numeric_limits<float>::infinity();
};

inline constexpr std::uint32_t kNoPrim = 0xFFFFFFFFu;
inline constexpr std::uint32_t kNoGeometry = 0xFFFFFFFFu;

/// A triangle of a mesh, or none.
struct Primitive {
    std::uint32_t prim_id = kNoPrim;
    std::uint32_t geom_id = kNoGeometry;
    bool operator==(const Primitive&) const = default;
};

/// The closest hit of a ray, or a miss: {infinity, 0, 0, kNoPrim, kNoGeometry}, so that
/// the nearest of two hits is that of the lower t.
///
/// The hit point is (1 - u - v) * p0 + u * p1 + v * p2 for the corners p0, p1, p2 of triangle
/// `prim_id` (a number from 0 in the mesh `geom_id`), and org + t * dir up to rounding. Among
/// triangles hit at the same t, the lowest (geom_id, prim_id) is the hit. Triangles are hit from
/// both sides; one with two corners at one place, or with a corner that is not finite, is never
/// hit. A triangle of three corners on a line is hit where rounding gives it a width, so that it
/// closes the gap between its neighbours. An edge that two triangles share lets no ray through.
struct Hit {
    /// Rounded to a float; of a hit, a larger value becomes the largest float.
    float t = std::numeric_limits<float>::infinity();
    float u = 0;
    float v = 0;
    std::uint32_t prim_id = kNoPrim;
    std::uint32_t geom_id = kNoGeometry;

    /// Whether it is a hit.
    explicit operator bool() const { return prim_id != kNoPrim; }
    Primitive primitive() const { return {prim_id, geom_id}; }
    bool operator==(const Hit&) const = default;
};

static_assert(sizeof(Vec3) == 12 && sizeof(Ray) == 32 && sizeof(Hit) == 20);

}  // namespace morphray
