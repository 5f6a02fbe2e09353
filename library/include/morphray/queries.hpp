// Questions about all triangles of a scene, how they are asked, and their answers.
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
    /// One triangle for each edge and each vertex of a mesh, however many share it: the first in
    /// the order of (t, prim_id). So the hit of intersect() is among them, also on the border of an
    /// open mesh. Edges and vertices of a mesh are one if they lie at one place.
    once,
    /// Each triangle there, as the closest hit of intersect() does.
    each,
    /// One of those that it passes through, so that a closed mesh is entered as often as it is left
    /// (Edelsbrunner, Mücke, Simulation of Simplicity, TOG 9(1), 1990). A ray that touches an edge
    /// or a vertex without passing through the surface hits none of the triangles there, or two.
    owner,
};

/// The threads that answer a batch of rays.
enum class Threads {
    all,      ///< Those of the device.
    calling,  ///< The one that calls, for callers who have threads of their own.
};

/// What a caller knows of the rays of a batch. Answers have the same bits whatever it says, right
/// or wrong; only their time depends on it.
struct Coherence {
    enum class Kind : std::uint8_t { none, image, sort };
    Kind kind = Kind::none;
    /// Of kind image alone.
    std::size_t width = 0;

    /// Nothing: they are traced in the order given. The default.
    static constexpr Coherence none() { return {}; }
    /// They are those of an image, row by row, with `width` rays a row; the last row may be
    /// shorter. On the CPU tiles of them are traced in packets if they start at one point, lie on a
    /// grid up to half a step, and have the interval [0, infinity). Rows below 8 rays are traced as
    /// by none().
    static constexpr Coherence image(std::size_t width) { return {Kind::image, width}; }
    /// They come in any order. On the CPU, and on Vulkan devices that are the processor, 8192 and
    /// more are sorted, up to 2^20 at a time; answers keep their places. A scene on the CPU keeps
    /// 10 bytes a ray for that, at most 10 MB.
    static constexpr Coherence sort() { return {Kind::sort, 0}; }
};

/// How a batch of rays or points is answered. The defaults see all meshes.
struct QueryOptions {
    Coherence coherence = {};
    Threads threads = Threads::all;
    /// The meshes that exist for the call: those with visible[geom_id] != 0. One flag a geom_id, up
    /// to the highest: another number throws bad_argument. Nothing: all.
    std::optional<std::span<const std::uint8_t>> visible = {};
    /// For each ray or point the triangle that does not exist for it, such as that of the hit on
    /// which a ray starts. With prim_id kNoPrim it is the whole mesh geom_id, such as the body that
    /// carries a sensor; with kNoGeometry, too, none. Another number of them, and a triangle or
    /// mesh that the scene does not have, throw bad_argument. Nothing: none.
    ///
    /// Answers have the bits of a scene of the remaining triangles with the same bounds. A closed
    /// mesh that loses a triangle is open. With `visible` or `excluded` the host's threads answer
    /// points for a Vulkan device, too, as in Scene::closest_points().
    std::optional<std::span<const Primitive>> excluded = {};
    /// If it is given, the call throws cancelled if it is true before, also for an empty batch, and
    /// soon after another thread has made it true: once each thread of the CPU has answered the
    /// point or 64 rays that it is at, and a device its submission of some milliseconds or 64 rays
    /// or points. What was not found by then is left as it was.
    const std::atomic<bool>* cancel = nullptr;
};

struct AllHitsOptions {
    Crossing crossing = Crossing::once;
    /// The most hits that are listed for a ray: the first ones. More are counted. All hits of a ray
    /// take memory meanwhile if it goes through an edge or a vertex, by Crossing::once, or does not
    /// see everything.
    std::uint32_t max_hits = std::numeric_limits<std::uint32_t>::max();
};

/// The hits of some rays.
struct AllHits {
    /// One more number than rays: the hits of ray i are hits[offsets[i]] to hits[offsets[i + 1]],
    /// without the last.
    std::vector<std::uint64_t> offsets = {0};
    /// By ray, and then in the order of (t, geom_id, prim_id).
    std::vector<Hit> hits = {};
    /// For each ray, the hits beyond max_hits that are not listed.
    std::vector<std::uint64_t> left_out = {};

    std::size_t ray_count() const { return offsets.size() - 1; }
    /// The hits of a ray; ray < ray_count().
    std::span<const Hit> of_ray(std::size_t ray) const {
        return std::span(hits).subspan(offsets[ray], offsets[ray + 1] - offsets[ray]);
    }
};

/// What is inside, as the fill rules of drawing programs.
enum class FillRule {
    /// Crossings, counted with their sides, that do not add up to 0: the union of closed meshes
    /// whose triangles are counter-clockwise as seen from outside, or all from inside.
    nonzero,
    /// Odd numbers of crossings, whichever way triangles are turned. Where two meshes overlap is
    /// outside.
    odd,
};

enum class Feature : std::uint8_t { face, edge, vertex };

/// The point of a scene that is closest to a point asked about, or none: {{0, 0, 0}, infinity, 0,
/// 0, kNoPrim, kNoGeometry, Feature::face}.
struct ClosestPoint {
    Vec3 point = {};
    float distance = std::numeric_limits<float>::infinity();
    /// The weights of the triangle's corners p1 and p2, as in Hit. Where `feature` is edge one of
    /// u, v and 1 - (u + v) is 0, and two of them are where it is vertex.
    float u = 0;
    float v = 0;
    /// The lowest (geom_id, prim_id) of equally close triangles.
    std::uint32_t prim_id = kNoPrim;
    std::uint32_t geom_id = kNoGeometry;
    /// The part of the triangle that the point lies on.
    Feature feature = Feature::face;

    /// Whether there is one.
    explicit operator bool() const { return prim_id != kNoPrim; }
    bool operator==(const ClosestPoint&) const = default;
};

/// The pairs of triangles that Scene::crossings() is asked about.
struct CrossingOptions {
    /// The meshes whose triangles form pairs, by geom_id, in any order. Nothing: all.
    std::optional<std::span<const std::uint32_t>> geom_ids = {};
    /// If it is given, pairs have one triangle of geom_ids and one of these meshes.
    std::optional<std::span<const std::uint32_t>> other = {};
    /// The most pairs that are listed: the first ones. More are counted.
    std::uint64_t limit = std::numeric_limits<std::uint64_t>::max();
};

/// Two triangles, the lower (geom_id, prim_id) first.
struct CrossingPair {
    Primitive first;
    Primitive second;

    bool operator==(const CrossingPair&) const = default;
};

struct Crossings {
    /// In the order of (geom_id, prim_id) of the first triangles, and then of the second ones.
    std::vector<CrossingPair> pairs = {};
    /// The pairs beyond CrossingOptions::limit that are not listed.
    std::uint64_t left_out = 0;
};

}  // namespace morphray
