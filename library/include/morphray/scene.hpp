// A scene of deforming meshes on one device.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "morphray/device.hpp"
#include "morphray/error.hpp"
#include "morphray/geometry.hpp"
#include "morphray/mesh.hpp"
#include "morphray/queries.hpp"

namespace morphray {

// morphray/images.hpp.
struct View;
struct Image;
struct ImageStack;

namespace detail {
class SceneImpl;
}

/// One tree for all poses: each update refits it.
struct Refit {};
/// Each update builds a tree.
struct Rebuild {};
/// An update builds a tree after this many poses (1 to 1000000), and refits in between.
struct Every {
    std::uint32_t poses = 8;
};
/// Refits; restructures, or builds, when the tree's degradation has cost as much time as that would
/// take. What takes longer than the budget is restructured in slices, or built in the background.
struct Auto {
    /// The time that an update may add, in milliseconds, finite and not negative. 0: `budget`, a
    /// part of the time that refit and queries of a pose take.
    double budget_ms = 0;
    double budget = 0.75;
    /// Every run takes the same decisions: counts of triangles and rays take the place of times.
    /// Results never depend on the decisions.
    bool deterministic = false;
};
/// How the tree follows the meshes (Wald, Boulos, Shirley, TOG 26(1), 2007, section 5).
using UpdatePolicy = std::variant<Auto, Refit, Rebuild, Every>;

/// Reads a policy that users write: "refit", "rebuild", "every:K" with K from 1 to 1000000, or
/// "auto" for Auto{}. Throws bad_argument, which lists these, for any other text. Thread-safe.
MORPHRAY_API UpdatePolicy parse_update_policy(const std::string& text);

struct SceneOptions {
    /// The part of world space that the meshes move in; nothing: the bounds of the first pose. With
    /// the same bounds, equal positions give hits of equal bits on all machines and devices,
    /// whatever the poses before. As long as meshes leave the bounds, those of both together count.
    /// build() throws bad_argument if they are empty or not within the range of floats.
    std::optional<Box> bounds = {};
    /// The place in the caller's coordinates where world space has its 0. It is subtracted from
    /// positions in double before they are rounded to floats, so that coordinates such as those of
    /// UTM keep their digits. find_origin() gives one. Boxes and the points of a View are doubles
    /// in the caller's coordinates. Rays, points and closest points are relative to the origin, as
    /// Scene::less_origin() returns them. build() throws bad_argument if it is not finite.
    Point origin = {0, 0, 0};
    UpdatePolicy update = Auto{};
    /// Find the cost ratio at each update, even if the policy does not need it.
    bool record_cost_ratio = false;
    /// If it is given, build() and update() give up a tree within some milliseconds after another
    /// thread has made it true, and throw cancelled. After such an update() the scene is of no use
    /// any more. The flag must outlive the scene.
    const std::atomic<bool>* cancel = nullptr;
};

/// The change that an update made to the tree.
enum class Step {
    build,        ///< The first tree, or the first one over another set of meshes.
    keep,         ///< Nothing moved.
    refit,        ///< Boxes and vertices were written again.
    restructure,  ///< Refitted; degraded parts were built again.
    rebuild,      ///< Built at this pose.
    swap,         ///< Replaced by a tree from the background, refitted to this pose.
};
/// "build", "keep", ...
MORPHRAY_API const char* to_string(Step step) noexcept;

/// The vertices of a mesh whose triangles are not hit at this pose, and triangles that are not.
/// Vertices that no triangle uses do not count.
struct LeftOut {
    std::uint32_t geom_id = 0;
    std::uint64_t not_finite = 0;  ///< NaN, infinite, or beyond floats.
    std::uint64_t too_far = 0;     ///< As the far vertices of Scene.
    /// Triangles that have an area, but none in the steps of scene space, 2^-60 of its size, when
    /// meshes last came or went.
    std::uint64_t too_small = 0;
};

struct Update {
    Step step = Step::build;
    /// Why, as a clause for people: "the slow-down has cost a build".
    std::string reason;
    /// The cost of the tree by the surface area heuristic, relative to that when it was built and
    /// to the growth of its triangles; 1 if neither policy nor options ask for it.
    double cost_ratio = 1;
    bool build_pending = false;  ///< Whether a tree is being built in the background.
    /// By geom_id; empty for a sound scene.
    std::vector<LeftOut> left_out = {};

    /// Milliseconds. A part that did not happen is 0. A device may put a refit off until the first
    /// query, which then takes longer; last_update() tells its refit_ms afterwards.
    double read_ms = 0;    ///< Reading the caller's positions.
    double upload_ms = 0;  ///< Positions and trees to the device.
    double refit_ms = 0;
    double decide_ms = 0;  ///< Finding the cost ratio, and deciding.
    double restructure_ms = 0;
    double rebuild_ms = 0;

    double milliseconds() const {
        return read_ms + upload_ms + refit_ms + decide_ms + restructure_ms + rebuild_ms;
    }
};

struct TreeStatistics {
    /// Expected visits of nodes and tests of triangles of a random ray that meets the root's box.
    double sah_cost = 0;
    std::uint32_t node_count = 0;
    std::uint32_t leaf_count = 0;
    std::uint32_t depth = 0;
    std::uint64_t bytes = 0;
    /// XXH3 (64 bits) of nodes and leaves: the same on every device.
    std::uint64_t hash = 0;
};

/// The edges of a scene where its surface is not that of a solid. Vertices at one place are one
/// vertex, whatever their mesh; triangles without three places do not count.
struct EdgeCounts {
    std::uint64_t open = 0;    ///< Edges of one triangle.
    std::uint64_t shared = 0;  ///< Edges of more than two triangles.
    std::uint64_t turned = 0;  ///< Edges that two triangles run through in one direction.
    /// Edges that are run through more often in one direction than in the other: those that are
    /// open or turned, and some of the shared ones.
    std::uint64_t uneven = 0;
    /// Triangles of which another one has the same places in the opposite direction. Both enclose
    /// nothing. Triangles of the same direction are no twins: the surface winds twice there.
    std::uint64_t twins = 0;

    /// True if insides by the rule, signs of distances and, for nonzero, winding are those of a
    /// solid. If all triangles are twins, that is a solid without an inside.
    bool is_closed(FillRule rule = FillRule::nonzero) const {
        return uneven == (rule == FillRule::odd ? turned : 0);
    }
    bool operator==(const EdgeCounts&) const = default;
};

/// Meshes, the tree over them, and queries.
///
/// Threads: const members may be called by any number of threads at the same time. update(),
/// attach(), detach(), moving and destroying a scene need it for themselves; a second thread in
/// update(), attach() or detach() gets Error(busy), queries meanwhile are undefined. Different
/// scenes are independent.
///
/// Errors: any member throws bad_argument if the scene has been moved from. If update() throws
/// anything but bad_argument and busy, such as limit (no memory) or device_lost, the scene is of no
/// use any more: queries and updates throw the same until it is destroyed. Any other call that
/// throws has changed nothing.
///
/// Far vertices: the steps of scene space are 2^-60 of the scene's size, so that one vertex far
/// away would make all others coarse. So let r be the least power of two that holds the largest
/// coordinate, relative to the origin, of more than half of the vertices that are finite, used by a
/// triangle and not at the origin; where that is beyond 2^52 times the bounds, or the size of
/// at least half of the meshes of a scene without bounds, r is theirs. Vertices outside the bounds
/// (SceneOptions::bounds) that have a coordinate beyond 2^37 r, and beyond the power of two that
/// holds the bounds, are left out as if they were not finite: their triangles are never hit, and
/// everything else has the bits of a scene without them. Update::left_out counts them. Vertices
/// that no triangle uses are never read.
///
/// Memory: 12 bytes a vertex and 24 bytes a triangle for positions and indices, and some 40 bytes a
/// triangle for the tree. A mesh that has coordinates below 2^-36 of the bounds, such as 1e-17, or
/// not finite, takes 12 bytes a vertex more, and so does one that has a pose. A background build
/// takes as much again as the tree. Images keep up to 340 MB for the next one.
class MORPHRAY_API Scene {
public:
    /// Builds a scene of meshes with the geom_ids 0, 1, ... in order, or of one; there may be none.
    /// Time: O(n log n) in the triangles, some 0.1 us a triangle and core. Throws bad_input for an
    /// index that is out of range (named), or triangles that are not in threes; bad_argument for
    /// positions without data, a stride below 12 and unsuitable options; limit above 2^28
    /// triangles.
    static Scene build(const MeshView& mesh, const Device& device = Device::cpu(),
                       const SceneOptions& options = {});
    static Scene build(std::span<const MeshView> meshes, const Device& device = Device::cpu(),
                       const SceneOptions& options = {});

    Scene(Scene&& other) noexcept;
    Scene& operator=(Scene&& other) noexcept;
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;
    ~Scene();

    /// Reads the positions of all deforming meshes without a pose again and brings the tree to
    /// them. Time: O(n) in vertices and triangles of what moved.
    Update update();
    /// Reads `count` positions of one mesh from `first` on, also if it does not deform. Throws
    /// bad_argument if they are not in the mesh.
    Update update(std::uint32_t geom_id, std::size_t first, std::size_t count);
    /// Borrows other positions for a mesh from now on, as many as it has, and reads them. Throws
    /// bad_argument, which changes nothing, for another number of them, no data, a stride below 12.
    Update update(std::uint32_t geom_id, const Positions& positions);
    /// Moves meshes by matrices. The position of a vertex becomes M p + t, where p is its rest
    /// position: that of the mesh's array, rounded to floats without the origin, at the first pose
    /// of the mesh. They are copied, 12 bytes a vertex. From then on update() reads no positions of
    /// this mesh; update(geom_id, ...) reads rest positions, and keeps the pose.
    ///
    /// M is rounded to floats, and t less the origin, a difference of doubles, too. Each coordinate
    /// is ((m0 * x + m1 * y) + m2 * z) + t in floats, each operation rounded, so that callers can
    /// compute the same bits. M may scale, shear and mirror. A mirror keeps the order of corners:
    /// normals and windings are then those of a mesh turned inside out.
    ///
    /// Throws bad_argument, which changes nothing, for a geom_id that the scene lacks or that comes
    /// twice, after attach() or detach() without an update(), and for numbers that are not finite
    /// as floats. Vertices that a matrix moves beyond floats are left out (Update::left_out).
    Update update(std::span<const MeshPose> poses);
    Update update(std::uint32_t geom_id, const Transform& transform);
    /// As update(), but first replaces the bounds by those of all positions: hits have the bits of
    /// a new scene of these meshes without SceneOptions::bounds.
    Update update_with_new_bounds();

    /// Adds a mesh, from the next update() on. Returns its geom_id, the lowest free one. Throws
    /// what build() throws. That update builds what changed and refits the rest, unless more than
    /// half of all triangles are new or the bounds are left, which takes a build.
    std::uint32_t attach(const MeshView& mesh);
    /// Removes a mesh from the next update() on; until then its positions stay borrowed. Its
    /// geom_id is free afterwards. Throws bad_argument if there is none of this geom_id.
    void detach(std::uint32_t geom_id);

    /// Returns what the last build or update() did, with the times that are known by now.
    Update last_update() const;

    /// Finds the closest hits: hits[i] answers rays[i]. Many rays are traced on all threads of the
    /// device, few in the calling thread. On a Vulkan device a call is a submission, and so is each
    /// hit that a ray passes by because it does not see it. Throws bad_argument if sizes differ,
    /// device_lost, limit; cancelled.
    void intersect(std::span<const Ray> rays, std::span<Hit> hits,
                   const QueryOptions& options = {}) const;
    /// One ray, for callers that need each hit before they make the next ray.
    Hit intersect(const Ray& ray) const;
    Hit intersect(const Ray& ray, const QueryOptions& options) const;

    /// Finds whether rays hit anything: occluded[i] is 1 if rays[i] does, else 0. As intersect().
    void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded,
                  const QueryOptions& options = {}) const;
    bool occluded(const Ray& ray) const;
    bool occluded(const Ray& ray, const QueryOptions& options) const;

    /// Finds all hits of rays, each once: none is lost, and hits at one t are all there. Memory: 20
    /// bytes a hit and 16 bytes a ray, twice while the answer is made; at most 2 * max_hits + 16
    /// hits a ray and thread besides. Throws as intersect(); limit if the memory does not suffice.
    AllHits intersect_all(std::span<const Ray> rays, const AllHitsOptions& all = {},
                          const QueryOptions& options = {}) const;
    /// The next hit of a ray: the first one after (t, geom_id, prim_id) of `after`, which need not
    /// be a hit of the scene; none after a miss. To step through the hits that intersect() and
    /// occluded() know, each once, also where t is rounded, a denormal or too large for a float:
    ///
    ///     for (Hit hit = scene.intersect(ray); hit; hit = scene.intersect(ray, hit)) ...
    ///
    /// Throws bad_argument if t of `after` is NaN.
    Hit intersect(const Ray& ray, const Hit& after, Crossing crossing = Crossing::each,
                  const QueryOptions& options = {}) const;
    /// Counts all hits: counts[i] is the number of those of rays[i]. Throws as intersect().
    void count(std::span<const Ray> rays, std::span<std::uint64_t> counts,
               Crossing crossing = Crossing::once, const QueryOptions& options = {}) const;

    /// Finds the unit normals of hits: normals[i] answers hits[i]; 0 for a miss and a triangle
    /// without an area. The corners of a triangle are counter-clockwise as seen from where its
    /// normal points. `smooth` interpolates those of Appearance::smooth, as lit images do;
    /// O(triangles) for the first ones after an update. Throws bad_argument if sizes differ or a
    /// hit is none of this scene.
    void normals(std::span<const Hit> hits, std::span<Vec3> normals, bool smooth = false) const;

    /// Finds how often the meshes wind around points: windings[i] answers points[i]. 1 inside a
    /// closed mesh whose triangles are counter-clockwise as seen from outside, 0 outside; nested
    /// and overlapping meshes add up. It counts how often a half-line from the point along +z
    /// leaves the meshes, minus how often it enters them (Crossing::owner). It is exact for the
    /// coordinates given: no rounding decides, however close to the surface a point lies.
    ///
    /// - A point on the surface has the winding of one of its neighbours, that of
    ///   p + (e, e^2, e^3) for e -> 0; contains() tells it apart.
    /// - The half-line of a mesh with holes may leave through one: then the number is that of the
    ///   crossings, and says nothing about inside. T-joints that no triangle closes are holes
    ///   without a width, and self-intersections are overlaps.
    /// - Triangles with a corner that is left out (Update::left_out) do not count, so that a closed
    ///   mesh that loses some is open; a point that is not finite is outside. Coordinates below
    ///   2^-37 of the scene's extent are rounded to 2^-60 of it.
    ///
    /// Throws as intersect().
    void winding(std::span<const Vec3> points, std::span<std::int32_t> windings,
                 const QueryOptions& options = {}) const;
    /// Finds which points are inside: inside[i] is 1 if points[i] is inside by the rule or lies on
    /// a triangle, exactly, else 0. As winding() otherwise.
    void contains(std::span<const Vec3> points, std::span<std::uint8_t> inside,
                  FillRule rule = FillRule::nonzero, const QueryOptions& options = {}) const;

    /// Finds the closest points of the meshes no farther than max_distance: closest[i] answers
    /// points[i]. Triangle, feature and place are exact but for the rounding of the place. The
    /// distance is that of the exact place, at most 2 ulp off, and 0 only on the triangle
    /// (docs/design/arithmetic.md, "Distances"). None is found for a point that is not finite. The
    /// host's threads answer for a device, too: the first call after an update reads the tree back.
    /// Throws bad_argument for a max_distance that is negative or NaN; otherwise throws as
    /// intersect().
    void closest_points(std::span<const Vec3> points, std::span<ClosestPoint> closest,
                        float max_distance = std::numeric_limits<float>::infinity(),
                        const QueryOptions& options = {}) const;
    /// The distances from points to the meshes, negative inside by the rule of contains(), 0 for a
    /// point that lies on a triangle. Up to 2^-14 of the scene's size and of the point's distance
    /// from its middle they are those of closest_points(), and need the tree as these do. Farther
    /// ones take less time, and are off by up to 2^-21 of the distance of the farthest corner of
    /// the closest triangle, or of one that is as near up to such an error, or by a step of
    /// denormals. Infinity, negative inside, if nothing is found within max_distance; NaN for a
    /// point that is not finite. Throws as closest_points().
    void signed_distance(std::span<const Vec3> points, std::span<float> distances,
                         FillRule rule = FillRule::nonzero,
                         float max_distance = std::numeric_limits<float>::infinity(),
                         const QueryOptions& options = {}) const;

    /// Finds the pairs of triangles that cross: that have a point in common which lies on no vertex
    /// and on no edge that both have by position. So neighbours in a mesh cross only where one is
    /// folded back onto the other or goes through it, and equal triangles do. Exact for the
    /// positions as floats, relative to the origin, and the same for all devices, threads and trees
    /// (docs/guide/queries.md). A triangle without area is a segment or a point. Triangles with a
    /// corner that is left out (Update::left_out) have no crossings.
    ///
    /// `visible`, `threads` and `cancel` of the query options are those of rays; `excluded` must be
    /// empty. The host answers for a device, too, whose tree is read back after an update. Throws
    /// bad_argument for a geom_id that no mesh has; otherwise throws as intersect().
    Crossings crossings(const CrossingOptions& which = {}, const QueryOptions& options = {}) const;
    /// Whether there is any such pair, with which the search ends.
    bool has_crossings(const CrossingOptions& which = {}, const QueryOptions& options = {}) const;

    /// Renders an image. Throws bad_input for an impossible view (eye and target coincide, up is
    /// parallel to the view, a number is not finite), bad_argument for a width, height or ao_count
    /// of 0, limit for more pixels or ao_count than View allows.
    Image render(const View& view) const;
    /// Renders into `image`, whose memory it uses again: allocation may take longer than tracing.
    /// One call at a time with one image. If it throws, `image` is one of nothing in particular.
    void render(const View& view, Image& image) const;

    /// Renders views of one size together into the channels that `stack` has arrays for; nothing
    /// else is made, or copied from a device. Each pixel has the bits of the view's own image. A
    /// call is one submission of up to 2^21 rays (2^18 on lavapipe), which View::cancel divides if
    /// it takes more than some tens of milliseconds. View::cancel and progress of the first view
    /// count. There may be no views. Throws what render() of each view does; bad_argument for
    /// different sizes, several samples, other Rays than primary, other Shading than plain, and
    /// arrays of another size. The arrays then have any values.
    ///
    /// Memory: a CPU device keeps 64 KiB a thread, or 24 bytes a pixel of a view if it has shaded.
    void render(std::span<const View> views, ImageStack& stack) const;

    /// A scene over the same meshes at the current pose with a copy of this tree on another device,
    /// and `cancel` in place of SceneOptions::cancel. Throws what build() throws.
    Scene on(const Device& device, const std::atomic<bool>* cancel = nullptr) const;

    /// Reads the tree back from a device, which takes O(n).
    TreeStatistics tree_statistics() const;

    /// The boxes of the tree at a depth, in the caller's coordinates: at 0 that of the whole scene,
    /// at 1 those of the root's children, and so on, without leaves above; empty below the tree.
    /// Reads the tree back from a device, which takes O(n).
    std::vector<Box> tree_boxes(std::uint32_t depth) const;

    const Device& device() const;
    /// Returns SceneOptions::origin.
    const Point& origin() const;
    /// Subtracts the origin from the caller's coordinates and rounds them once, or adds it again.
    Vec3 less_origin(const Point& point) const;
    Point plus_origin(const Vec3& point) const;
    std::uint64_t triangle_count() const;
    std::uint64_t vertex_count() const;
    /// The bounds at the current pose of all vertices but those that are left out or that no
    /// triangle uses; lower > upper if there are none.
    Box bounds() const;
    /// Counts edges, but for those of triangles with a vertex that is left out, at the pose of the
    /// first call with these meshes, which takes some 0.5 us a triangle.
    EdgeCounts edge_counts() const;

private:
    friend class detail::SceneImpl;
    explicit Scene(std::unique_ptr<detail::SceneImpl> impl);
    std::unique_ptr<detail::SceneImpl> impl_;
};

}  // namespace morphray
