"""trimesh's queries of rays and distances over morphray, with its arguments and results.

    import morphray.trimesh

    mesh.ray = morphray.trimesh.RayMeshIntersector(mesh)
    mesh.nearest = morphray.trimesh.ProximityQuery(mesh)
    mesh.contains(points)

A mesh is any object with `vertices`, (V, 3) numbers, and `faces`, (F, 3) integers; trimesh itself is
not imported. One that moved is updated, not built anew.

Answers are those of morphray.Scene: for coordinates that are rounded to float32, relative to a place
near the mesh if it is far from 0. Locations, closest points and distances are float64 arrays of such
numbers.
"""

import threading as _threading
from typing import Any, Optional, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

import morphray as _morphray

_Floats = NDArray[np.float64]
_Ints = NDArray[np.int64]

# trimesh's tol.merge: distances that it does not tell apart.
_MERGE = 1e-8
# Rays start this part of the mesh's size before their origins, to meet what lies there.
_BACK = 2.0**-18


def _rows(array, name, dtype=np.float64):
    rows = np.asarray(array, dtype)
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
    return _rows(faces, "faces", np.int64)


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
                self._read(_rows(self.mesh.vertices, "vertices"), _faces_of(self.mesh))
            except BaseException:
                # Members may be of two poses. The next query builds anew.
                self.scene = self._key = None
                raise
            self._key = key

    def _read(self, vertices, faces):
        same_faces = self.scene is not None and np.array_equal(faces, self.faces)
        if same_faces and np.array_equal(vertices, self.points, equal_nan=True):
            return
        if same_faces and vertices.shape == self.points.shape:
            self.points[:] = vertices
            self.scene.update_with_new_bounds()
        else:
            # Copies, since a later change is found by comparison.
            self.points, self.faces = vertices.copy(order="C"), faces.copy()
            self.scene = _morphray.Scene(self.points, self.faces, device=self.device)
            self._fans = None
        self.lower, self.upper = self.scene.bounds

    def faces_at(self, vertices):
        """The faces at each of `vertices`: (place in `vertices`, face) of each pair."""
        if self._fans is None:
            corners = self.faces.ravel()
            order = np.argsort(corners, kind="stable")
            self._fans = corners[order], order // 3
        corners, fan = self._fans
        first, last = (np.searchsorted(corners, vertices, side) for side in ("left", "right"))
        count = last - first
        owner = np.repeat(np.arange(len(vertices)), count)
        within = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
        return owner, fan[first[owner] + within]

    def contains(self, points):
        """No point outside of the bounds is inside, also of a mesh with holes."""
        in_bounds = ((points >= self.lower) & (points <= self.upper)).all(axis=1)
        return in_bounds & self.scene.contains(points, rule=self.rule)

    def facing(self, found, points):
        """Of the triangles at the closest edges and vertices, those that face the points most."""
        corners = self.faces[found["prim_id"]]
        # 1 - (u + v) is 0 on the edge opposite of the first corner.
        weights = np.stack([1 - (found["u"] + found["v"]), found["u"], found["v"]], axis=-1)
        owner, faces = self.faces_at(corners[np.arange(len(found)), weights.argmax(axis=1)])
        at = self.faces[faces]
        has = (at[:, :, None] == corners[owner][:, None, :]).any(axis=1) | (weights[owner] <= 0)
        owner, faces = owner[has.all(axis=1)], faces[has.all(axis=1)]
        a, b, c = np.moveaxis(self.points[self.faces[faces]], 1, 0)
        normals = np.cross(b - a, c - a)
        with np.errstate(invalid="ignore"):
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        facing = np.einsum("ij,ij->i", np.nan_to_num(normals), (points - found["point"])[owner])
        order = np.lexsort((faces, -facing, owner))
        return faces[order[np.flatnonzero(np.diff(owner[order], prepend=-1))]]


class RayMeshIntersector:
    """Rays against a mesh, as trimesh.ray.ray_pyembree.RayMeshIntersector.

    geometry:     the mesh
    scale_to_box: has no effect
    device:       what morphray.Scene takes
    rule:         which points are inside: "odd" numbers of crossings, as in trimesh, or "nonzero"
                  windings, for which overlapping bodies are one

    ray_origins and ray_directions are (n, 3) numbers; directions have any length but 0. A ray hits
    what it starts on, as in trimesh. A ray through an edge or a vertex of a closed mesh has one hit
    there, where trimesh lists up to one a triangle. Hits are by ray, the closest one first. What lies
    before an origin, up to 2^-18 of the size of the mesh, is hit, too.

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
        triangles, rays, locations = self._hits(ray_origins, ray_directions, multiple_hits, max_hits,
                                                excluded)
        return (triangles, rays, locations) if return_locations else (triangles, rays)

    def intersects_location(self, ray_origins: ArrayLike, ray_directions: ArrayLike,
                            multiple_hits: bool = True, *,
                            excluded: Optional[ArrayLike] = None) -> Tuple[_Floats, _Ints, _Ints]:
        """Finds the places where rays hit. Returns (locations, index_ray, index_tri)."""
        triangles, rays, locations = self._hits(ray_origins, ray_directions, multiple_hits, None,
                                                excluded)
        return locations, rays, triangles

    def intersects_first(self, ray_origins: ArrayLike, ray_directions: ArrayLike, *,
                         excluded: Optional[ArrayLike] = None) -> _Ints:
        """Finds the first triangle of each ray, -1 for a miss."""
        origins = _rows(ray_origins, "ray_origins")
        triangles, rays, _ = self._hits(origins, ray_directions, False, None, excluded)
        first = np.full(len(origins), -1, np.int64)
        first[rays] = triangles
        return first

    def intersects_any(self, ray_origins: ArrayLike, ray_directions: ArrayLike, *,
                       excluded: Optional[ArrayLike] = None) -> NDArray[np.bool_]:
        """Finds whether rays hit anything."""
        return self.intersects_first(ray_origins, ray_directions, excluded=excluded) >= 0

    def contains_points(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Finds which points are inside by `rule`, as Scene.contains(). None outside of the bounds is
        inside."""
        rows = _rows(points, "points")
        self._followed.update()
        with np.errstate(over="ignore"):
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
        followed = self._followed
        followed.update()
        with np.errstate(all="ignore"):
            step = directions / np.abs(directions).max(axis=1, keepdims=True)
            back = _BACK * (followed.upper - followed.lower).max()
            rays = np.hstack([origins - back * step, step])
            if multiple_hits or max_hits == 0:
                found = followed.scene.intersect_all(rays, max_hits=max_hits, excluded=excluded)
                hits, ray_ids = found.hits, found.ray_ids
            else:
                found = followed.scene.intersect(rays, coherence="sort", excluded=excluded)
                ray_ids = np.flatnonzero(found["prim_id"] != _morphray.INVALID_ID)
                hits = found[ray_ids]
        triangles = hits["prim_id"].astype(np.int64)
        p0, p1, p2 = np.moveaxis(followed.points[followed.faces[triangles]], 1, 0)
        u, v = hits["u"][:, None], hits["v"][:, None]
        return triangles, ray_ids, p0 + u * (p1 - p0) + v * (p2 - p0)


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
        with np.errstate(over="ignore"):
            found = followed.scene.closest_points(rows)
        is_found = found["prim_id"] != _morphray.INVALID_ID
        closest = np.where(is_found[:, None], found["point"], np.nan).astype(np.float64)
        distance = found["distance"].astype(np.float64)
        triangle_id = np.where(is_found, found["prim_id"].astype(np.int64), -1)
        at_edge = (found["feature"] != 0) & is_found & (distance > _MERGE)
        triangle_id[at_edge] = followed.facing(found[at_edge], rows[at_edge])
        return closest, distance, triangle_id

    def signed_distance(self, points: ArrayLike) -> _Floats:
        """The distances to the mesh, positive inside (RayMeshIntersector.contains_points()) and within
        1e-8 of it, as in trimesh."""
        rows = _rows(points, "points")
        distance = self.on_surface(rows)[1]
        with np.errstate(over="ignore"):
            outside = ~self._followed.contains(rows) & (distance > _MERGE)
        distance[outside] *= -1
        return distance
