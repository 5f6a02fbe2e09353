"""trimesh's queries of rays and distances over morphray, with its arguments and results.

    import morphray.trimesh

    mesh.ray = morphray.trimesh.RayMeshIntersector(mesh)
    mesh.nearest = morphray.trimesh.ProximityQuery(mesh)
    mesh.contains(points)

A mesh is any object with `vertices`, (V, 3) numbers, and `faces`, (F, 3) integers; trimesh itself is
not imported. Coordinates are below 1e100, and a mesh is 0 or at least 1e-100 large. One that moved is
updated, not built anew.

Which triangles are hit and closest is decided for coordinates that are rounded to float32 relative to
the mesh; locations, distances, hits behind an origin and points inside are then found in float64.
"""

import threading as _threading
import typing as _typing
from typing import Any, Optional, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

import morphray as _morphray

_Floats = NDArray[np.float64]
_Ints = NDArray[np.int64]

# trimesh's tol.merge: distances that it does not tell apart.
_MERGE = 1e-8
# The meshes fill this box after _Frame.
_BOUNDS = ((-1, -1, -1), (1, 1, 1))
# Rays start this far before their origins, in a frame, to meet what lies there: positions are rounded
# by 2^-24. float64 decides then which hits lie before the origin.
_BACK = 2.0**-18
# Below this sine of the angle between ray and triangle, locations are those of the triangle, not of
# the ray: they are then within 2^-14 of each other in a frame.
_GRAZING = 2.0**-10
# Rounding may move a point so near from one side of the mesh to the other, in a frame.
_NEAR = 2.0**-22
# Places of a frame that float64 does not tell apart.
_SAME = 2.0**-48
# From a point on the mesh to one whose winding Scene.winding() gives for it.
_BESIDE = 2.0**-30, 2.0**-40, 2.0**-50


def _rows(array, name):
    rows = np.asarray(array, np.float64)
    if np.ma.is_masked(array):
        raise ValueError(f"{name}: elements of the array are masked; filled() unmasks them")
    if rows.shape == (0,):
        return rows.reshape(0, 3)
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise ValueError(f"{name}: a shape of (n, 3) is needed, not {rows.shape}")
    return rows


def _key_of(mesh):
    """What changes with the mesh: its hash if its class has one, else what the cache of a trimesh
    holds for it; None for other meshes."""
    if type(mesh).__hash__ not in (None, object.__hash__):
        return hash(mesh)
    cache = getattr(mesh, "_cache", None)
    if not hasattr(cache, "verify"):
        return None
    cache.verify()
    return getattr(cache, "id_current", None)


def _faces_of(mesh):
    faces = np.asarray(mesh.faces)
    if faces.size > 0 and faces.dtype.kind not in "iu":
        raise TypeError(f"faces: integers are needed, not {faces.dtype}")
    return _rows(faces, "faces").astype(np.int64)


def _lower_and_upper(points):
    """The bounds of the finite ones of points; lower > upper if there are none."""
    def bounds(rows):
        # Columns are reduced several times as fast as rows of three.
        return [np.array([least.reduce(column, initial=start) for column in rows.T])
                for least, start in ((np.minimum, np.inf), (np.maximum, -np.inf))]

    of_all = bounds(points)
    return of_all if np.isfinite(of_all).all() else bounds(points[np.isfinite(points).all(axis=1)])


def _dot(a, b):
    return np.einsum("ij,ij->i", a, b)


def _normals_of(corners):
    """The unit normals of triangles, (n, 3, 3); 0 without an area."""
    with np.errstate(invalid="ignore", over="ignore"):
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        return np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)


def _closest_on(corners, normals, points):
    """For each point the closest one of its triangle (Ericson, Real-Time Collision Detection, 2005,
    section 5.1.5)."""
    p0, p1, p2 = np.moveaxis(corners, 1, 0)
    best = p0.copy()
    best_distance = np.full(len(points), np.inf)
    for start, end in ((p0, p1), (p1, p2), (p2, p0)):
        edge = end - start
        length = _dot(edge, edge)
        s = np.divide(_dot(points - start, edge), length, out=np.zeros_like(length),
                      where=length > 0)
        on_edge = start + np.clip(s, 0, 1)[:, None] * edge
        on_edge[s >= 1] = end[s >= 1]
        distance = _dot(points - on_edge, points - on_edge)
        closer = distance < best_distance
        best[closer], best_distance[closer] = on_edge[closer], distance[closer]
    # Inside of all edges, the projection is closer.
    projected = points - _dot(points - p0, normals)[:, None] * normals
    inside = normals.any(axis=1)
    for start, end in ((p0, p1), (p1, p2), (p2, p0)):
        inside &= _dot(np.cross(end - start, projected - start), normals) >= 0
    best[inside] = projected[inside]
    return best


class _Frame(_typing.NamedTuple):
    """Maps a mesh into [-1, 1] on all axes: by a power of two, and by a shift where it is farther from
    0 than it is large. Vertices that are float32 keep all of their bits."""

    origin: Any
    scale: float

    @staticmethod
    def of(points):
        lower, upper = _lower_and_upper(points)
        if lower[0] > upper[0]:
            return _Frame(np.zeros(3), 1.0)
        # Halves, since differences may be infinite.
        centre, extent = lower / 2 + upper / 2, (upper / 2 - lower / 2).max() * 2
        # As many bits as a float32 has: differences with float32 from there on are exact.
        part, exponent = np.frexp(centre)
        near = np.ldexp(part.astype(np.float32).astype(np.float64), exponent)
        origin = np.where(np.abs(centre) > extent, near, 0.0)
        size = np.maximum(np.abs(lower - origin), np.abs(upper - origin)).max()
        exponent = np.frexp(size)[1] if size > 0 else 0
        return _Frame(origin, float(2.0 ** -np.clip(exponent, -1022, 1022)))

    def exact(self, points):
        return (points - self.origin) * self.scale

    def points(self, points):
        with np.errstate(over="ignore", invalid="ignore"):
            return self.exact(points).astype(np.float32)


class _MeshScene:
    """A scene that follows a mesh."""

    def __init__(self, mesh, device, rule):
        self.mesh = mesh
        self.device = device
        self.rule = rule
        self._lock = _threading.Lock()
        self._key = None
        self.scene = None

    def __getstate__(self):
        return self.mesh, self.device, self.rule

    def __setstate__(self, state):
        self.__init__(*state)

    def update(self):
        """Brings all members to the mesh. _key_of() tells whether it has changed; without a key the
        arrays are compared."""
        with self._lock:
            key = _key_of(self.mesh)
            if key is not None and key == self._key:
                return
            try:
                if self.scene is None or not self._is_same():
                    # A copy, whose rows are read in place.
                    vertices = np.array(self.mesh.vertices, order="C", subok=True)
                    self._read(_rows(vertices, "vertices"), _faces_of(self.mesh))
            except BaseException:
                # Members may be of two poses. The next query builds anew.
                self.scene = self._key = None
                raise
            self._key = key

    def _is_same(self):
        """Whether the arrays have not changed, as far as this is quick to find."""
        return (np.array_equal(self.mesh.vertices, self.vertices)
                and np.array_equal(self.mesh.faces, self.faces))

    def _read(self, vertices, faces):
        same_faces = self.scene is not None and np.array_equal(faces, self.faces)
        if same_faces and np.array_equal(vertices, self.vertices, equal_nan=True):
            return
        frame = _Frame.of(vertices)
        points = frame.points(vertices)
        if same_faces and vertices.shape == self.vertices.shape:
            self._points[:] = points
            self.scene.update()
        else:
            self.scene = _morphray.Scene(points, faces, device=self.device, bounds=_BOUNDS)
            self._points = points
        self.vertices, self.faces, self.frame = vertices, faces, frame
        self._bounds = None
        if not same_faces:
            self._fans = None

    def normals(self, faces):
        """The unit normals of these faces; 0 without an area."""
        # Scaled, so that products neither overflow nor vanish.
        return _normals_of(self.vertices[self.faces[faces]] * self.frame.scale)

    def faces_at(self, vertices):
        """The faces at each of `vertices`: (place in `vertices`, face) of each pair."""
        if self._fans is None:
            # The faces at vertex v are fan[first[v]:first[v + 1]].
            corners = self.faces.ravel()
            count = np.bincount(corners, minlength=len(self.vertices))
            self._fans = (np.concatenate([[0], np.cumsum(count)]),
                          np.argsort(corners, kind="stable") // 3)
        first, fan = self._fans
        count = first[vertices + 1] - first[vertices]
        owner = np.repeat(np.arange(len(vertices)), count)
        within = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
        return owner, fan[first[vertices][owner] + within]

    def contains(self, points):
        """No point outside of the bounds is inside, also of a mesh with holes."""
        if self._bounds is None:
            used = np.zeros(len(self.vertices), bool)
            used[self.faces] = True
            self._bounds = _lower_and_upper(self.vertices[used])
        lower, upper = self._bounds
        in_bounds = ((points >= lower) & (points <= upper)).all(axis=1)
        inside = np.zeros(len(points), bool)
        inside[in_bounds] = self._winds_around(points[in_bounds])
        return inside

    def _winds_around(self, points):
        rounded = self.frame.points(points)
        inside = self.scene.contains(rounded, rule=self.rule)
        found = self.scene.closest_points(rounded, max_distance=_NEAR)
        near = np.flatnonzero(found["prim_id"] != _morphray.INVALID_ID)
        if len(near) == 0:
            return inside
        # The winding of the rounded point, and what it changes that float64 has another side.
        owner, faces = self.faces_at(self.faces[found["prim_id"][near]].ravel())
        owner, faces = np.unique([owner // 3, faces], axis=1)
        on_rounded = (found["distance"][near] == 0)[:, None]
        beside = rounded[near] + np.where(on_rounded, _BESIDE, 0)
        rows = self.faces[faces]
        if self.rule == "odd":
            rows = _aligned(rows, owner)
        before, _ = _sides(self._points[rows].astype(np.float64), beside, owner)
        after, is_on = _sides(self.frame.exact(self.vertices[rows]),
                              self.frame.exact(points[near]), owner)
        winding = self.scene.winding(rounded[near]) - before + after
        # Each crossing changes the winding by 1, so that both are odd together.
        inside[near] = is_on | ((winding if self.rule == "nonzero" else winding & 1) != 0)
        return inside

    def closest_on(self, faces, points):
        """For each point the closest one of its face."""
        return _closest_on(self.vertices[self.faces[faces]], self.normals(faces), points)


def _aligned(faces, owner):
    """Faces of one owner that share edges, turned into the direction of the first of them."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    edges = np.stack([np.repeat(owner, 3), np.minimum(start, end), np.maximum(start, end)])
    order = np.lexsort(edges)
    shared = (np.diff(edges[:, order]) == 0).all(axis=0)
    a, b = order[:-1][shared], order[1:][shared]
    differ = start[a] == start[b]
    # Twice the first face that each is connected to, and whether it is to be turned.
    label, before = 2 * np.arange(len(faces)), None
    while differ.any() and (before is None or (label != before).any()):
        before = label.copy()
        np.minimum.at(label, b // 3, label[a // 3] ^ differ)
        np.minimum.at(label, a // 3, label[b // 3] ^ differ)
    return np.where(label[:, None] & 1, faces[:, ::-1], faces)


def _sides(corners, points, owner):
    """Whether point i is behind the closest of the triangles with owner i, as 0 or 1, and whether it
    lies on it. Angle-weighted normals decide (Bærentzen, Aanæs, Signed Distance Computation Using the
    Angle Weighted Pseudonormal, TVCG 11(3), 2005)."""
    normals = _normals_of(corners)
    places = _closest_on(corners, normals, points[owner])
    apart = np.linalg.norm(points[owner] - places, axis=1)
    order = np.lexsort((apart, owner))
    best = order[np.flatnonzero(np.diff(owner[order], prepend=-1))]
    to_corners = corners - places[best][owner][:, None]
    length = np.linalg.norm(to_corners, axis=2)
    corner, row = np.argmin(length, axis=1), np.arange(len(owner))
    a, b = to_corners[row, corner - 1], to_corners[row, corner - 2]
    angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), _dot(a, b))
    angle[length.min(axis=1) > _SAME] = np.pi
    angle[~(np.linalg.norm(places - places[best][owner], axis=1) <= _SAME)] = 0
    normal = np.zeros(points.shape)
    np.add.at(normal, owner, angle[:, None] * normals)
    return (_dot(normal, points - places[best]) < 0).astype(int), apart[best] <= _SAME


class _Hits(_typing.NamedTuple):
    triangles: Any
    rays: Any
    locations: Any


class RayMeshIntersector:
    """Rays against a mesh, as trimesh.ray.ray_pyembree.RayMeshIntersector.

    geometry:     the mesh
    scale_to_box: has no effect
    device:       what morphray.Scene takes
    rule:         which points are inside: "odd" numbers of crossings, as in trimesh, or "nonzero"
                  windings, for which overlapping bodies are one

    ray_origins and ray_directions are (n, 3) numbers; directions have any length but 0. A ray hits
    what it starts on, as in trimesh. A ray through an edge or a vertex of a closed mesh has one hit
    there, where trimesh lists up to one a triangle. Hits are by ray, the closest one first.

    Any number of threads may use it at the same time; nothing may change the mesh meanwhile.
    """

    def __init__(self, geometry: Any, scale_to_box: bool = True, *, device: Any = "cpu",
                 rule: str = "odd") -> None:
        self.mesh = geometry
        self._followed = _MeshScene(geometry, device, rule)

    def intersects_id(self, ray_origins: ArrayLike, ray_directions: ArrayLike,
                      multiple_hits: bool = True, max_hits: Optional[int] = None,
                      return_locations: bool = False, *,
                      excluded: Optional[ArrayLike] = None) -> Tuple[NDArray[Any], ...]:
        """Finds the triangles that rays hit: all of each ray, up to max_hits, or the closest one.
        Returns (index_tri, index_ray), (h,) int64 each, and perhaps locations, (h, 3) float64.

        excluded: (n,) integers: for each ray a triangle that it leaves out, or -1
        """
        hits = self._hits(ray_origins, ray_directions, multiple_hits, max_hits, excluded)
        if return_locations:
            return hits.triangles, hits.rays, hits.locations
        return hits.triangles, hits.rays

    def intersects_location(self, ray_origins: ArrayLike, ray_directions: ArrayLike,
                            multiple_hits: bool = True, *,
                            excluded: Optional[ArrayLike] = None) -> Tuple[_Floats, _Ints, _Ints]:
        """Finds the places where rays hit. Returns (locations, index_ray, index_tri)."""
        hits = self._hits(ray_origins, ray_directions, multiple_hits, None, excluded)
        return hits.locations, hits.rays, hits.triangles

    def intersects_first(self, ray_origins: ArrayLike, ray_directions: ArrayLike, *,
                         excluded: Optional[ArrayLike] = None) -> _Ints:
        """Finds the first triangle of each ray, -1 for a miss."""
        origins = _rows(ray_origins, "ray_origins")
        hits = self._hits(origins, ray_directions, False, None, excluded)
        first = np.full(len(origins), -1, np.int64)
        first[hits.rays] = hits.triangles
        return first

    def intersects_any(self, ray_origins: ArrayLike, ray_directions: ArrayLike, *,
                       excluded: Optional[ArrayLike] = None) -> NDArray[np.bool_]:
        """Finds whether rays hit anything."""
        return self.intersects_first(ray_origins, ray_directions, excluded=excluded) >= 0

    def contains_points(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Finds which points are inside by `rule`, as Scene.contains(). Nearer to the mesh than 2^-22
        of its size, the side of the closest triangle in float64 decides. None outside of the bounds
        is inside."""
        rows = _rows(points, "points")
        self._followed.update()
        return self._followed.contains(rows)

    def _hits(self, ray_origins, ray_directions, multiple_hits, max_hits, excluded):
        origins = _rows(ray_origins, "ray_origins")
        directions = _rows(ray_directions, "ray_directions")
        if origins.shape != directions.shape:
            raise ValueError(f"ray_origins, ray_directions: {len(origins)} and {len(directions)} "
                             "rows are not the same rays")
        if max_hits is not None and max_hits < 0:
            raise ValueError(f"max_hits: {max_hits} is below 0")
        if excluded is not None:
            excluded = np.asarray(excluded, np.int64)
            if excluded.shape != origins.shape[:1]:
                raise ValueError(f"excluded: a shape of ({len(origins)},) is needed, not "
                                 f"{excluded.shape}")
            excluded = np.stack([np.where(excluded == -1, -1, 0), excluded], axis=-1)
        self._followed.update()
        rays = self._cast_from(origins, directions)
        if multiple_hits:
            return _first_of_each(self._all(rays, origins, directions, excluded), max_hits)
        found = self._followed.scene.intersect(rays, coherence="sort", excluded=excluded)
        hit = np.flatnonzero(found["prim_id"] != _morphray.INVALID_ID)
        hits, ahead = self._locate(found[hit], hit, origins, directions)
        # Hits before the origin hide those behind it.
        again = hits.rays[~ahead]
        if len(again) == 0:
            return _first_of_each(hits, max_hits)
        rest = self._all(rays[again], origins[again], directions[again],
                         None if excluded is None else excluded[again], "each")
        rest = _first_of_each(rest._replace(rays=again[rest.rays]), 1)
        merged = [np.concatenate([a[ahead], b]) for a, b in zip(hits, rest)]
        order = np.argsort(merged[1], kind="stable")
        return _first_of_each(_Hits(*(array[order] for array in merged)), max_hits)

    def _cast_from(self, origins, directions):
        """Rays in the frame. Far ones are moved up to the mesh, so that origins are rounded less.
        Directions are scaled by powers of two, which keep their bits."""
        frame = self._followed.frame
        with np.errstate(all="ignore"):
            exponents = np.frexp(np.abs(directions).max(axis=1, initial=0))[1]
            step = np.ldexp(directions, -exponents[:, None])
            from_centre = (origins - frame.origin) * frame.scale
            # All of the mesh is within 2 of the centre; |step| is at least 1/2.
            to_mesh = -_dot(from_centre, step) / _dot(step, step) - 4
            begin = np.where(to_mesh > 0, to_mesh, 0) - _BACK
            rays = np.empty((len(origins), 6), np.float32)
            rays[:, :3] = from_centre + begin[:, None] * step
            rays[:, 3:] = step
        return rays

    def _all(self, rays, origins, directions, excluded, crossing="once"):
        found = self._followed.scene.intersect_all(rays, crossing=crossing, excluded=excluded)
        hits, ahead = self._locate(found.hits, found.ray_ids, origins, directions)
        return _Hits(*(array[ahead] for array in hits))

    def _locate(self, found, rays, origins, directions):
        """Hits with their locations, and whether each lies at the origin of its ray or ahead."""
        triangles = found["prim_id"].astype(np.int64)
        p0, p1, p2 = np.moveaxis(self._followed.vertices[self._followed.faces[triangles]], 1, 0)
        normals = self._followed.normals(triangles)
        origin, direction = origins[rays], directions[rays]
        with np.errstate(all="ignore"):
            slope = _dot(normals, direction)
            t = _dot(normals, p0 - origin) / slope
            locations = origin + t[:, None] * direction
            grazing = np.abs(slope) < _GRAZING * np.linalg.norm(direction, axis=1)
            u, v = found["u"].astype(np.float64)[:, None], found["v"].astype(np.float64)[:, None]
            on_triangle = p0 + u * (p1 - p0) + v * (p2 - p0)
            locations[grazing] = on_triangle[grazing]
            t = np.where(grazing, _dot(on_triangle - origin, direction), t)
        return _Hits(triangles, rays.astype(np.int64), locations), t >= 0


def _first_of_each(hits, count):
    """The first `count` hits of each ray, whose hits follow each other; None: all."""
    if count is None or len(hits.rays) == 0:
        return hits
    begins = np.flatnonzero(np.diff(hits.rays, prepend=hits.rays[0] - 1))
    number = np.arange(len(hits.rays)) - np.repeat(begins, np.diff(begins, append=len(hits.rays)))
    return _Hits(*(array[number < count] for array in hits))


class ProximityQuery:
    """Distances from a mesh, as trimesh.proximity.ProximityQuery, in units of the mesh. It has no
    vertex(): mesh.kdtree.query() answers that. device and rule are those of RayMeshIntersector."""

    def __init__(self, mesh: Any, *, device: Any = "cpu", rule: str = "odd") -> None:
        self._followed = _MeshScene(mesh, device, rule)

    def on_surface(self, points: ArrayLike) -> Tuple[_Floats, _Floats, _Ints]:
        """Finds the closest points of the mesh. Returns (closest, distance, triangle_id).

        At an edge or a vertex, triangle_id is the triangle that faces the point most, as in trimesh;
        then the lowest. Without a closest point, as for one that is not finite, they are NaN, inf
        and -1.
        """
        rows = _rows(points, "points")
        followed = self._followed
        followed.update()
        found = followed.scene.closest_points(followed.frame.points(rows))
        there = np.flatnonzero(found["prim_id"] != _morphray.INVALID_ID)
        closest = np.full(rows.shape, np.nan)
        distance = np.full(len(rows), np.inf)
        triangle_id = np.full(len(rows), -1, np.int64)
        triangle_id[there] = found["prim_id"][there]
        closest[there] = followed.closest_on(triangle_id[there], rows[there])
        distance[there] = np.linalg.norm(rows[there] - closest[there], axis=1)
        at_edge = there[(found["feature"][there] != 0) & (distance[there] > _MERGE)]
        self._face_points(found[at_edge], rows, closest, distance, triangle_id, at_edge)
        return closest, distance, triangle_id

    def _face_points(self, found, points, closest, distance, triangle_id, chosen):
        """Gives each chosen point the triangle around a corner that faces it most."""
        followed = self._followed
        # The corner of the largest weight has all triangles that are as close.
        u, v = found["u"].astype(np.float64), found["v"].astype(np.float64)
        corner = np.argmax(np.stack([1 - u - v, u, v], axis=-1), axis=1)
        owner, faces = followed.faces_at(followed.faces[triangle_id[chosen], corner])
        point = points[chosen][owner]
        on_face = followed.closest_on(faces, point)
        apart = np.linalg.norm(point - on_face, axis=1)
        equal = apart <= distance[chosen][owner] + _MERGE
        owner, faces, on_face, apart = owner[equal], faces[equal], on_face[equal], apart[equal]
        facing = _dot(followed.normals(faces), point[equal] - on_face) / apart
        # By owner, then by -facing, then by number.
        order = np.lexsort((faces, -facing, owner))
        best = order[np.flatnonzero(np.diff(owner[order], prepend=-1))]
        at = chosen[owner[best]]
        triangle_id[at], closest[at], distance[at] = faces[best], on_face[best], apart[best]

    def signed_distance(self, points: ArrayLike) -> _Floats:
        """The distances to the mesh, positive inside (RayMeshIntersector.contains_points()) and within
        1e-8 of it, as in trimesh."""
        rows = _rows(points, "points")
        distance = self.on_surface(rows)[1]
        outside = ~self._followed.contains(rows) & (distance > _MERGE)
        distance[outside] *= -1
        return distance
