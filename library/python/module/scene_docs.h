// The docstrings of morphray.Scene.
#pragma once

namespace morphray::python {

inline constexpr const char* kSceneDoc =
    R"(Scene(points, triangles=None, *, device="cpu", bounds=None, update="auto", budget_ms=0.0, budget=0.75, deterministic=False, split="binned", deforms=True, albedo=None, refit_on=None, record_cost_ratio=False, textures=None)
--

Deforming triangle meshes, the tree over them, and queries.

points:    (V, 3) float32, in any units, any distance apart. Borrowed: each update() reads the array
           in place, so write into it (points[:] = ...), and do not resize it. Triangles with points
           that are NaN or infinite are never hit.
triangles: (T, 3) uint32, int32, uint64 or int64, copied. Without triangles, points is a list of
           meshes: morphray.Mesh, or tuples of (points, triangles[, deforms[, albedo[, textures]]]),
           with geom_ids 0, 1, ... in order.
device:    a Device, "cpu", "vulkan" or "brute"
bounds:    (lower, upper), two points: the part of space that the meshes move in, which they may
           leave. With the same bounds, equal positions give equal bits on all machines and devices,
           whatever the poses before. None: the bounds of the first pose.
update:    how the tree follows the meshes: "auto", "refit", "rebuild", or "every:K" to build a tree
           after K poses. Results do not depend on it.
budget_ms, budget: for "auto", what an update may add: milliseconds, or, if they are 0, a part of the
           time that refit and queries of a pose take
deterministic: for "auto", decide by counts instead of times, so that all runs decide the same
split:     how trees are built: "binned", or "sweep", which is slower and gives the best tree
deforms:   whether update() reads the points again
albedo:    for images, the linear colour of each triangle: (T, 3) uint8, or (T,) uint32 with red in
           the lowest byte. None: light grey. Copied.
refit_on:  the device that refits, if it is not the one that traces
record_cost_ratio: find Update.cost_ratio at each update
textures:  for images by shading="lit", a morphray.Textures, copied. They are multiplied by albedo.

Any number of threads may query a scene at the same time. A change, update(), attach() or detach(), that
meets another call raises Error "busy". Ctrl-C ends queries, images, Scene() and update(); a scene whose
update() it ended is of no use any more.

Raises TypeError for what is no array or has another dtype, ValueError for a shape or strides that do not
fit, Error "bad_input" for an index that is out of range, "bad_argument", "unavailable" and "limit".)";
inline constexpr const char* kInitDoc =
    R"(__init__(self, points, triangles=None, *, device="cpu", bounds=None, update="auto", budget_ms=0.0, budget=0.75, deterministic=False, split="binned", deforms=True, albedo=None, refit_on=None, record_cost_ratio=False, textures=None)
--

See the class.)";

inline constexpr const char* kStepDoc =
    R"("build" (another set of meshes), "keep" (nothing moved), "refit", "restructure" (refitted, and
degraded parts built again), "rebuild", or "swap" (a tree from the background, refitted).)";
inline constexpr const char* kUpdateMethodDoc =
    R"(update(self, geom_id=None, first=0, count=None)
--

Reads the points of all deforming meshes again and brings the tree to them. Returns an Update.

With geom_id it reads count points of one mesh from first on, or all from there. Raises Error
"bad_argument" for a mesh or points that are not there.)";
inline constexpr const char* kNewBoundsDoc =
    R"(update_with_new_bounds(self)
--

The same as update(), but first replaces the bounds by those of all points, as Scene(...) without
bounds does.)";
inline constexpr const char* kAttachDoc =
    R"(attach(self, points, triangles, deforms=True, albedo=None, textures=None)
--

Adds a mesh, from the next update() on. Returns its geom_id, the lowest free one.)";
inline constexpr const char* kIntersectDoc =
    R"(intersect(self, rays, out=None, *, coherence="none")
--

Finds the closest hits. Hits have t > 0 and tnear <= t <= tfar; t is in units of dir.

rays: (N, 8) float32, org, tnear, dir and tfar, or (N,) ray_dtype: read in place if C-contiguous;
      (N, 6) float32, org and dir, with tnear 0 and tfar infinite. More axes in front are kept.
out:  a C-contiguous array of hit_dtype to write to, with one element a ray
coherence: what is known of the rays, for speed alone: "none"; "sort", they come in any order; or the
      width of the image whose rays they are, row by row

Returns an array of hit_dtype, `out` if it is given. The hit is at (1 - u - v) * p0 + u * p1 + v * p2. A
miss has the IDs INVALID_ID. At equal t the lowest (geom_id, prim_id) is the hit.

Raises TypeError for another dtype, ValueError for another shape, `out` or coherence.)";
inline constexpr const char* kOccludedDoc =
    R"(occluded(self, rays, out=None, *, coherence="none")
--

Finds whether rays hit anything: an array of bool. Arguments are those of intersect().)";
inline constexpr const char* kCastRaysDoc =
    R"(cast_rays(self, rays, *, coherence="none")
--

Finds the closest hits, with the result of Open3D's RaycastingScene.cast_rays(): a dict of t_hit (inf
for a miss), geometry_ids, primitive_ids, primitive_uvs and primitive_normals. The normals have length 1
and are computed from the points as they are now: call update() first. Arguments are those of
intersect(), which is faster.)";
inline constexpr const char* kTestOcclusionsDoc =
    R"(test_occlusions(self, rays, tnear=0.0, tfar=None, *, coherence="none")
--

Finds whether rays hit anything at tnear <= t <= tfar (None: infinite), as Open3D's RaycastingScene
does. Rays of eight numbers have a tnear and tfar of their own.)";

inline constexpr const char* kIntersectAllDoc =
    R"(intersect_all(self, rays, *, crossing="once", max_hits=None, cancel=None)
--

Finds all hits of rays, each once, as an AllHits; axes in front of the rays are flattened.

crossing: which triangles a ray through an edge or a vertex hits. "once": the first of its mesh there.
          "each": all of them. "owner": one by which it passes through the surface, so that a closed mesh
          is entered as often as it is left; none at a border or where it only touches.
max_hits: the most hits that are listed for a ray, the first ones. None: all
cancel:   a morphray.Cancel, which ends the call with Error "cancelled"

Takes 20 bytes a hit and 16 bytes a ray, twice while the answer is made. Raises Error "limit" if the
memory does not suffice.)";
inline constexpr const char* kCountDoc =
    R"(count(self, rays, out=None, *, crossing="once", coherence="none", cancel=None)
--

Counts all hits of rays: an array of int64. Arguments are those of intersect() and intersect_all().)";
inline constexpr const char* kWindingDoc =
    R"(winding(self, points, out=None, *, cancel=None)
--

Finds how often the meshes wind around points, exactly: 1 inside a closed mesh whose triangles are
counter-clockwise as seen from outside, 0 outside; meshes add up.

points: (N, 3) float32; more axes in front are kept
out:    a C-contiguous array of the result's dtype to write to
cancel: a morphray.Cancel, which ends the call with Error "cancelled"

Returns an array of int32: how often a half-line along +z leaves the meshes, less that of entering them.
A point on the surface has the winding of one of its neighbours, one that is not finite has 0.)";
inline constexpr const char* kContainsDoc =
    R"(contains(self, points, out=None, *, rule="nonzero", cancel=None)
--

Finds which points are inside, or lie on a triangle, exactly: an array of bool.

rule: which windings are inside, "nonzero", so that overlapping meshes are one, or "odd" numbers of
      crossings, so that where two meshes overlap is outside. Other arguments are those of winding().)";
inline constexpr const char* kClosestPointsDoc =
    R"(closest_points(self, points, max_distance=None, out=None, *, cancel=None)
--

Finds the closest points of the meshes, not farther than max_distance: an array of closest_dtype.

point is at (1 - u - v) * p0 + u * p1 + v * p2. feature is 0 inside of the triangle, 1 on an edge and 2 at
a corner. Of equally close triangles it is the lowest (geom_id, prim_id). Where there is none, distance is
inf and the IDs are INVALID_ID. Other arguments are those of winding().)";
inline constexpr const char* kSignedDistanceDoc =
    R"(signed_distance(self, points, out=None, *, rule="nonzero", max_distance=None, cancel=None)
--

Finds the distances of points to the meshes, negative inside: an array of float32. Arguments are those
of contains() and closest_points(). NaN for a point that is not finite.)";

inline constexpr const char* kRenderDoc =
    R"(render(self, size=(1024, 1024), *, eye=None, target=None, up=(0.0, 1.0, 0.0), fov=45.0, light=None, rays="primary", ao_count=16, ao_distance=0.0, shading="plain", samples=1, flat=False, cancel=None)
--

Renders an Image with a pinhole camera and a light. What is None is chosen so that the bounds of the
scene fill the image.

size:        (width, height) in pixels, from 1 to 65536 a side and at most 2^28 in all
eye, target, up, light: three numbers each, in the units of the points
fov:         vertical, in degrees
rays:        "primary", "shadow" (and a ray to the light from each hit) or "ao" (and
             ambient-occlusion rays from each hit)
ao_count:    ambient-occlusion rays a camera ray, up to 256
ao_distance: their length. 0: a quarter of the diagonal of the bounds
shading:     "plain" (by `rays`), "lit" (a light with shadows, and ambient occlusion), or what is
             shown as colours: "normal", "depth", "prim"; of the tree "steps" or "sah"
samples:     camera rays a pixel, 1, 4, 16 or 64; hits are then those of all samples
flat:        without smooth normals in "lit" and "normal"
cancel:      a morphray.Cancel, which ends the call with Error "cancelled"

Raises Error "bad_input" for an impossible view, "bad_argument" and "limit".)";

inline constexpr const char* kCancelDoc =
    R"(Cancel()
--

Ends calls that take one, in any number and in any thread:

    cancel = morphray.Cancel()
    threading.Timer(10, cancel.set).start()
    image = scene.render((4096, 4096), cancel=cancel)   # raises Error "cancelled" after 10 s)";
}  // namespace morphray::python
