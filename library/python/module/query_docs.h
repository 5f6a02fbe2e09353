// The docstrings of morphray.Scene's questions about all triangles.
#pragma once

namespace morphray::python {

inline constexpr const char* kIntersectAllDoc =
    R"(intersect_all(self, rays, *, crossing="owner", max_hits=None, cancel=None)
--

Finds all hits of rays, each once: none is lost, and hits at one t are all there.

rays:     those of intersect(); axes in front are flattened
crossing: which triangles a ray hits that goes through an edge or a vertex. "owner": one of those
          that it passes through, so that a closed mesh is entered as often as it is left; a ray
          that touches an edge or a vertex without passing through the surface hits none there, or
          two. "each": all of them, as intersect() does.
max_hits: the most hits that are listed for a ray, the first ones, from 0 to 2^32 - 1; None: all
cancel:   a morphray.Cancel, by which another thread, or a handler of signals, ends the call

Returns an AllHits (offsets, hits, left_out). The hits of ray i are hits[offsets[i]:offsets[i + 1]],
in the order of (t, geom_id, prim_id). A ray that intersect() says hits nothing has none.

Memory: 20 bytes a hit and 16 bytes a ray, twice while the answer is made.

Raises TypeError and ValueError as intersect() does, ValueError for another crossing or max_hits;
Error "cancelled" after cancel.set(), "limit" if the memory does not suffice. Any number of threads
may call it at the same time.

Source: Edelsbrunner, Mücke, Simulation of Simplicity, TOG 9(1), 1990.)";

inline constexpr const char* kCountDoc =
    R"(count(self, rays, out=None, *, crossing="owner", coherence="none", cancel=None)
--

Counts all hits of rays.

rays, crossing, cancel: those of intersect_all()
out:                    an array of int64 to write to, one element a ray: C-contiguous and writable
coherence:              that of intersect()

Returns an array of int64, one a ray; `out` if it is given. Axes in front of the rays are kept.
Raises what intersect_all() raises, ValueError for another coherence.)";

inline constexpr const char* kWindingDoc =
    R"(winding(self, points, out=None, *, cancel=None)
--

Finds how often the meshes wind around points: 1 inside a closed mesh whose triangles are
counter-clockwise as seen from outside, 0 outside; nested and overlapping meshes add up.

points: (N, 3) float32, in the units of the scene's; read in place if C-contiguous and aligned. More
        axes in front are kept in the result.
out:    an array of int32 to write to, one element a point: C-contiguous and writable
cancel: a morphray.Cancel, by which another thread, or a handler of signals, ends the call

Returns an array of int32, one a point; `out` if it is given. It is the number of times that a
half-line from the point along +z leaves the meshes, less that of entering them, and exact for the
coordinates given: no rounding decides, however close to the surface a point lies.

A point on the surface has the winding of one of its neighbours; contains() tells it apart. The
half-line of a mesh with holes may leave through one: then the number is that of the crossings, and
says nothing about inside. A point that is NaN or infinite has 0, and so has any point of a scene
without triangles.

Raises TypeError for another dtype, ValueError for another shape or an unsuitable `out`, Error
"cancelled" after cancel.set(), "device_lost" and "limit". Any number of threads may call it at the
same time.)";

inline constexpr const char* kContainsDoc =
    R"(contains(self, points, out=None, *, rule="nonzero", cancel=None)
--

Finds which points are inside by the rule, or lie on a triangle, exactly.

points, cancel: those of winding()
out:            an array of bool to write to, one element a point: C-contiguous and writable
rule:           which windings are inside. "nonzero": those that are not 0, so that overlapping
                meshes are one, and a mesh that is turned inside out lies inside, too. "odd": odd
                numbers of crossings, whichever way triangles are turned; where two meshes overlap
                is outside

Returns an array of bool, one a point; `out` if it is given. A point that is NaN or infinite is
outside. Raises what winding() raises, ValueError for another rule.)";

inline constexpr const char* kClosestPointsDoc =
    R"(closest_points(self, points, max_distance=None, out=None, *, cancel=None)
--

Finds the closest points of the meshes.

points, cancel: those of winding()
max_distance:   the farthest that is looked for, in units of the points; not negative. None: infinite
out:            an array of closest_dtype to write to, one element a point: C-contiguous and writable

Returns an array of closest_dtype with the fields

point:    (3,) float32
distance: float32
u, v:     float32: point is (1 - u - v) * p0 + u * p1 + v * p2
prim_id:  uint32: of equally close triangles the lowest (geom_id, prim_id)
geom_id:  uint32
feature:  uint32: 0 if the point is inside of the triangle, 1 on an edge, where one of u, v and
          1 - (u + v) is 0, 2 at a corner, where two of them are

or `out` if it is given. Where there is none, distance is inf and prim_id and geom_id are
INVALID_ID; all else is 0. That is so beyond max_distance, in a scene without triangles, for a point
that is NaN or infinite, and more than a million scene sizes away. Distances are those of vertices
that are moved by up to 2^-24 of their distance from the point, up to 2^-20 of it; the answer is the
same on all machines and devices.

Raises what winding() raises, Error "bad_argument" for a max_distance that is negative or NaN.)";

inline constexpr const char* kSignedDistanceDoc =
    R"(signed_distance(self, points, out=None, *, rule="nonzero", max_distance=None, cancel=None)
--

Finds the distances of points to the meshes, negative inside.

points, cancel: those of winding()
out:            an array of float32 to write to, one element a point: C-contiguous and writable
rule:           that of contains()
max_distance:   that of closest_points()

Returns an array of float32, one a point; `out` if it is given. It has the distances of
closest_points(): 0 for a point that lies on a triangle, inf (inside -inf) if there is none within
max_distance, NaN for a point that is NaN or infinite. Raises what contains() and closest_points()
raise.)";

}  // namespace morphray::python
