// Options of queries, and the answers of those about all triangles.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "morphray/geometry.hpp"

namespace morphray {

/// Which triangles a ray hits that goes through an edge or a vertex.
enum class Crossing {
    /// The first one in the order of (t, prim_id) of all that share the edge or vertex, so that the
    /// hit of intersect() is among them. Edges and vertices of a mesh are one if they coincide.
    once,
    /// Each triangle there, as intersect() does.
    each,
    /// One by which it passes through the surface, so that a closed mesh is entered as often as it
    /// is left (Edelsbrunner, Mücke, Simulation of Simplicity, TOG 9(1), 1990). Where a ray only
    /// touches the surface it hits none of the triangles there, or two.
    owner,
};

/// The threads that answer a batch of rays.
enum class Threads {
    all,      ///< Those of the device.
    calling,  ///< The calling one, for callers with threads of their own.
};

/// What a caller knows of the rays of a batch. Only the time of answers depends on it.
struct Coherence {
    enum class Kind : std::uint8_t { none, image, sort };
    Kind kind = Kind::none;
    /// Of kind image alone.
    std::size_t width = 0;

    /// They are traced in the order given.
    static constexpr Coherence none() { return {}; }
    /// They are an image, row by row, with `width` rays a row; the last row may be shorter. On the
    /// CPU, tiles are traced in packets if rays start at one point, lie on a grid up to half a
    /// step, and have the interval [0, infinity). Rows below 8 rays are traced as by none().
    static constexpr Coherence image(std::size_t width) { return {Kind::image, width}; }
    /// They come in any order. On the processor, 8192 and more are sorted, up to 2^20 at a time;
    /// answers keep their places. A scene keeps 10 bytes a ray for that, at most 10 MB.
    static constexpr Coherence sort() { return {Kind::sort, 0}; }
};

/// How a batch of rays or points is answered. The defaults see all meshes.
struct QueryOptions {
    Coherence coherence = {};
    Threads threads = Threads::all;
    /// Rays see only meshes with visible[geom_id] != 0. One flag a geom_id, up to the highest:
    /// another number throws bad_argument. Nothing: all. Not for points.
    std::optional<std::span<const std::uint8_t>> visible = {};
    /// The triangle that each ray leaves out, such as that on which it starts. Another number of
    /// them throws bad_argument. Nothing: none. Not for points.
    std::optional<std::span<const Primitive>> excluded = {};
    /// If given, the call throws cancelled if it is true before, also for an empty batch, and soon
    /// after another thread has made it true: within some milliseconds, or once each thread of the
    /// CPU has answered its point or 64 rays, and a device its submission of some milliseconds or
    /// 64 rays or points. Other answers are left as they were.
    const std::atomic<bool>* cancel = nullptr;
};

struct AllHitsOptions {
    Crossing crossing = Crossing::once;
    /// The most hits that are listed for a ray: the first ones. More are counted. All of them take
    /// memory meanwhile with QueryOptions::visible or excluded, and at edges by Crossing::once.
    std::uint32_t max_hits = std::numeric_limits<std::uint32_t>::max();
};

struct AllHits {
    /// The hits of ray i are those in [offsets[i], offsets[i + 1]).
    std::vector<std::uint64_t> offsets = {0};
    /// By ray, and then in the order of (t, geom_id, prim_id).
    std::vector<Hit> hits = {};
    /// For each ray, the number of hits beyond max_hits.
    std::vector<std::uint64_t> left_out = {};

    std::size_t ray_count() const { return offsets.size() - 1; }
    /// The hits of a ray; ray < ray_count().
    std::span<const Hit> of_ray(std::size_t ray) const {
        return std::span(hits).subspan(offsets[ray], offsets[ray + 1] - offsets[ray]);
    }
};

/// Which windings are inside, as the fill rules of drawing programs.
enum class FillRule {
    /// Those that are not 0: the union of closed meshes, also of one turned inside out.
    nonzero,
    /// Those with an odd number of crossings. Where two meshes overlap is outside.
    odd,
};

enum class Feature : std::uint8_t { face, edge, vertex };

/// The point of a scene that is closest to a given one, or none: a default ClosestPoint.
struct ClosestPoint {
    Vec3 point = {};
    float distance = std::numeric_limits<float>::infinity();
    /// As in Hit. One of u, v and 1 - (u + v) is 0 for Feature::edge, and two for vertex.
    float u = 0;
    float v = 0;
    /// The lowest (geom_id, prim_id) of equally close triangles.
    std::uint32_t prim_id = kNoPrim;
    std::uint32_t geom_id = kNoGeometry;
    Feature feature = Feature::face;

    explicit operator bool() const { return prim_id != kNoPrim; }
    bool operator==(const ClosestPoint&) const = default;
};

}  // namespace morphray
