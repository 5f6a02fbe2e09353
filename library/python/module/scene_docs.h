// The docstrings of morphray.Scene.
#pragma once

namespace morphray::python {

inline constexpr const char* kSceneDoc =
    R"(Scene(points, triangles=None, *, device="cpu", bounds=None, update="auto", budget_ms=0.0, budget=0.75, deterministic=False, split="binned", deforms=True, albedo=None, refit_on=None, record_cost_ratio=False, textures=None)
--

Deforming triangle meshes, the tree over them, and queries.

    scene = morphray.Scene(points, triangles)
    while simulate(points):                     # writes into the array
        scene.update()
        hits = scene.cast_rays(rays)

points:    (V, 3) float32, in any units. Borrowed: each update() reads the array in place, so write
           into it (points[:] = ...). The three numbers of a point are next to each other; points
           may be any distance apart, as in a field of a structured array or in a slice. The array
           may be read-only. Points that are NaN or infinite make their triangles unhittable.
           While the scene lives, do not resize the array.
triangles: (T, 3) uint32, int32, uint64 or int64: three indices of points each. Copied once.
           Without triangles, points is a list of meshes: morphray.Mesh, or tuples of
           (points, triangles[, deforms[, albedo[, textures]]]), with geom_ids 0, 1, ... in order.
device:    a Device, "cpu", "vulkan" or "brute".
bounds:    (lower, upper), two points: the part of space that the meshes move in. It fixes the last
           bits of all hits: with the same bounds, equal positions give equal bits on all machines
           and devices, whatever the poses before. None: the bounds of the first pose. Meshes may
           leave them.
update:    how the tree follows the meshes: "auto", "refit", "rebuild", or "every:K" to build a
           tree after K poses. Results do not depend on it.
budget_ms: for "auto", the milliseconds that an update may add. 0: budget decides.
budget:    for "auto", the same as a part of the time that refit and queries of a pose take. Both are
           finite and not negative.
deterministic: for "auto", decide by counts instead of times, so that all runs decide the same.
split:     how trees are built: "binned", or "sweep", which is slower and gives the best tree.
deforms:   whether update() reads the points again.
albedo:    for images, the colour of each triangle: (T, 3) uint8 or (T,) uint32 with red in bits 0
           to 7, green in 8 to 15, blue in 16 to 23; linear. None: light grey. Copied once.
refit_on:  the device that refits, if it is not the one that traces.
record_cost_ratio: find Update.cost_ratio at each update, even if the policy does not need it.
textures:  for images by shading="lit", a morphray.Textures: images, and where on them the corners
           of triangles are. Colours are multiplied by albedo, or by white without it. Copied once.

Threads: any number may query a scene at the same time. update(), attach() and detach() need it for
themselves: a call that meets another one raises Error "busy". The GIL is released while a call
works.

Ctrl-C, and any signal whose handler raises, ends queries and images in the main thread, and leaves
the scene as it was; `out` then has any contents. It ends Scene() and update() of many triangles, too,
and a scene whose update() it ended is of no use any more. attach() and on() run to their end first.

Raises TypeError for what is no array or has another dtype, ValueError for a shape or strides that
do not fit, Error "bad_input" for an index that is out of range, "bad_argument" for empty or
infinite bounds, "unavailable" for a device that is not there, "limit" above 2^28 triangles.)";

inline constexpr const char* kInitDoc =
    R"(__init__(self, points, triangles=None, *, device="cpu", bounds=None, update="auto", budget_ms=0.0, budget=0.75, deterministic=False, split="binned", deforms=True, albedo=None, refit_on=None, record_cost_ratio=False, textures=None)
--

See the class.)";

inline constexpr const char* kUpdateDoc =
    "What Scene.update() did. Times are in milliseconds; a part that did not happen is 0.";
inline constexpr const char* kStepDoc =
    R"("build", "keep", "refit", "restructure", "rebuild" or "swap".

build:       the first tree, or one over another set of meshes
keep:        nothing moved
refit:       boxes and vertices were written again
restructure: refitted, and its degraded parts built again
rebuild:     built at this pose
swap:        replaced by a tree from the background, refitted to this pose)";
inline constexpr const char* kCostRatioDoc =
    R"(The cost of the tree relative to that when it was built.

1 if neither the policy nor record_cost_ratio asks for it.)";
inline constexpr const char* kSahCostDoc =
    "Expected visits of nodes and tests of triangles of a random ray that meets the root's box.";

inline constexpr const char* kUpdateMethodDoc =
    R"(update(self, geom_id=None, first=0, count=None)
--

Reads the points of all deforming meshes again and brings the tree to them. Returns an Update.

With geom_id it reads count points of one mesh from first on, or all from there; other points are
those of the last update. Takes time in proportion to what moved.

Raises Error "bad_argument" for a mesh or points that are not there, "busy", "limit" and
"device_lost".)";

inline constexpr const char* kNewBoundsDoc =
    R"(update_with_new_bounds(self)
--

The same as update(), but first replaces the bounds by those of all points, as Scene(...) without
bounds does. Hits then have the same bits as those of a new scene.)";

inline constexpr const char* kAttachDoc =
    R"(attach(self, points, triangles, deforms=True, albedo=None, textures=None)
--

Adds a mesh, from the next update() on. Returns its geom_id, the lowest free one. Arguments and
exceptions are those of Scene.)";
inline constexpr const char* kDetachDoc =
    R"(detach(self, geom_id)
--

Removes a mesh from the next update() on, which lets its array go. Raises Error "bad_argument" if
there is no such mesh.)";
inline constexpr const char* kLastUpdateDoc =
    R"(last_update(self)
--

What the last build or update() did, with the times that are known by now: a device may put a refit
off until the first query.)";

inline constexpr const char* kIntersectDoc =
    R"(intersect(self, rays, out=None, *, coherence="none")
--

Finds the closest hits.

rays: float32, one of
      (N, 8)  org.x org.y org.z tnear dir.x dir.y dir.z tfar, or (N,) of morphray.ray_dtype, which
              is the same in memory: read in place if C-contiguous and aligned
      (N, 6)  org.x org.y org.z dir.x dir.y dir.z, with tnear 0 and tfar infinite
      More axes in front are kept in the result: (H, W, 6) gives (H, W). dir has any length but 0;
      t is in units of it. Hits have t > 0 and tnear <= t <= tfar: a ray that starts on a triangle
      does not hit it there. A ray with a NaN, with a dir of 0, with tnear > tfar or with tfar <= 0
      hits nothing.
out:  an array of hit_dtype to write to, with one element a ray: C-contiguous and writable.
coherence: what is known of the rays. Hits are the same bits whatever it says; the time is not.
      "none"  nothing: they are traced in the order given
      "sort"  they come in any order: many are sorted on the CPU
      an int  they are those of an image of this width, row by row, from 0 to 2^32 - 1: on the CPU
              they are traced in packets. Rows below 8 rays are traced as by "none".

Returns an array of hit_dtype with the fields t, u, v (float32), prim_id, geom_id (uint32); `out` if
it is given. The hit is at (1 - u - v) * p0 + u * p1 + v * p2. A miss is (0, 0, 0, INVALID_ID,
INVALID_ID). Among triangles hit at the same t, the lowest (geom_id, prim_id) is the hit.

Raises TypeError for another dtype, ValueError for another shape, an unsuitable `out` or another
coherence.)";

inline constexpr const char* kOccludedDoc =
    R"(occluded(self, rays, out=None, *, coherence="none")
--

Finds whether rays hit anything. Returns an array of bool, one a ray; `out` if it is given. Rays and
coherence are those of intersect().)";

inline constexpr const char* kCastRaysDoc =
    R"(cast_rays(self, rays, *, coherence="none")
--

Finds the closest hits, with the result of Open3D's RaycastingScene.cast_rays(): a dict of

t_hit:             (N,) float32, inf for a miss
geometry_ids:      (N,) uint32, INVALID_ID for a miss
primitive_ids:     (N,) uint32, INVALID_ID for a miss
primitive_uvs:     (N, 2) float32, 0 for a miss
primitive_normals: (N, 3) float32, (p1 - p0) x (p2 - p0) with length 1; 0 for a miss. They are
                   computed from the points as they are in the arrays now: call update() first.

Rays and coherence are those of intersect(), which is faster.)";

inline constexpr const char* kTestOcclusionsDoc =
    R"(test_occlusions(self, rays, tnear=0.0, tfar=None, *, coherence="none")
--

Finds whether rays hit anything at t > 0 with tnear <= t <= tfar (None: infinite), as Open3D's
RaycastingScene does. Returns an array of bool, one a ray. Rays of eight numbers have a tnear and tfar of
their own. coherence is that of intersect().)";

inline constexpr const char* kRenderDoc =
    R"(render(self, size=(1024, 1024), *, eye=None, target=None, up=(0.0, 1.0, 0.0), fov=45.0, light=None, rays="primary", ao_count=16, ao_distance=0.0, shading="plain", samples=1, flat=False, cancel=None)
--

Renders an image with a pinhole camera and a light, and returns an Image. What is None is chosen so
that the bounds of the scene fill the image.

size:        (width, height) in pixels, from 1 to 65536 a side and at most 2^28 in all
eye, target, up, light: three numbers each, in the units of the points
fov:         vertical, in degrees, between 0 and 180
rays:        "primary", "shadow" (and a ray to the light from each hit) or "ao" (and
             ambient-occlusion rays from each hit)
ao_count:    ambient-occlusion rays a camera ray, from 1 to 256; with shading "lit" also 0
ao_distance: their length. 0: a quarter of the diagonal of the bounds
shading:     "plain" (by `rays`), "lit" (a light with shadows, and ambient occlusion), or what is
             shown as colours: "normal", "depth", "prim"; of the tree "steps" or "sah"
samples:     camera rays a pixel, 1, 4, 16 or 64; hits are then those of all samples
flat:        without smooth normals in "lit" and "normal"
cancel:      a morphray.Cancel, by which another thread, or a handler of signals, ends the call

Ctrl-C ends the call. Raises Error "bad_input" for an impossible view, "bad_argument" for a size or
ao_count of 0, "limit" for more, "cancelled" after cancel.set().)";

inline constexpr const char* kCancelDoc =
    R"(Cancel()
--

Ends calls that take one: Scene.render(), as View::cancel does in C++, and Scene's intersect_all(),
count(), winding(), contains(), closest_points() and signed_distance():

    cancel = morphray.Cancel()
    threading.Timer(10, cancel.set).start()
    image = scene.render((4096, 4096), cancel=cancel)   # raises Error "cancelled" after 10 s

Its methods are those of threading.Event that do not wait. Any thread may call them at any time, and
any number of calls may have one Cancel.)";
inline constexpr const char* kCancelSetDoc =
    R"(set(self)
--

Ends all calls that have this Cancel, and lets later ones end at once, each by Error "cancelled".

On the CPU a call ends within some milliseconds, by brute force after 64 x 64 pixels or 1024 rays or
points a thread, and on a Vulkan device after 2^18 of them. The scene is as it was before the call.)";
inline constexpr const char* kCancelClearDoc =
    R"(clear(self)
--

Lets calls that begin from now on run to their end.)";
inline constexpr const char* kCancelIsSetDoc =
    R"(is_set(self)
--

Whether set() has been called since the last clear().)";

inline constexpr const char* kOnDoc =
    R"(on(self, device)
--

A scene over the same arrays with a copy of this tree on another device, at the current pose.
Afterwards both go their own ways.)";
inline constexpr const char* kTreeStatisticsDoc =
    R"(tree_statistics(self)
--

Reads the tree back from the device, and returns TreeStatistics.)";
inline constexpr const char* kBoundsDoc =
    R"((lower, upper), two (3,) float64: of the finite points at the pose of the last update.

lower > upper if there are none.)";

}  // namespace morphray::python
