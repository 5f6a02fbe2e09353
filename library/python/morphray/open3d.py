"""Open3D's RaycastingScene over morphray: its names, arguments, keys and dtypes.

    import morphray.open3d

    scene = morphray.open3d.RaycastingScene()     # instead of o3d.t.geometry.RaycastingScene()
    scene.add_triangles(mesh)
    distances = scene.compute_signed_distance(points)

Where rays, points or matrices are tensors of Open3D, so are results. Others are numpy's arrays with
the methods numpy() and isfinite() of tensors. Meshes of Open3D are accepted. It is not imported.
"""

import threading as _threading
from typing import Any, Dict, List

import numpy as np
from numpy.typing import NDArray

import morphray as _morphray

# The sine of the angle between up and the view up to which they are parallel.
_PARALLEL = 1e-9


def _array(tensor):
    """A tensor of Open3D as an array; all else as it is."""
    if isinstance(tensor, np.ndarray) or not hasattr(tensor, "numpy"):
        return tensor
    return (tensor.cpu() if hasattr(tensor, "cpu") else tensor).numpy()


def _rays(tensor):
    """Rays, and their coherence: (height, width, 6) is an image, as create_rays_pinhole() makes."""
    rays = _array(tensor)
    return rays, rays.shape[1] if getattr(rays, "ndim", 0) == 3 else "sort"


def _matrix(array, name, shape):
    matrix = np.asarray(_array(array), np.float64)
    if matrix.shape != shape:
        raise ValueError(f"{name}: a shape of {shape} is needed, not {matrix.shape}")
    return matrix


def _primitives(hits):
    """The members of hits that all queries return."""
    return {
        "geometry_ids": hits["geom_id"].copy(),
        "primitive_ids": hits["prim_id"].copy(),
        "primitive_uvs": np.stack([hits["u"], hits["v"]], axis=-1),
    }


class _Results(np.ndarray):
    """An array with methods of tensors."""

    def numpy(self) -> NDArray[Any]:
        return np.asarray(self)

    def isfinite(self) -> NDArray[np.bool_]:
        return np.isfinite(self)


def _results(array, given):
    """An array, or a dict of some, as tensors if that was `given`."""
    if isinstance(array, dict):
        return {name: _results(member, given) for name, member in array.items()}
    from_numpy = getattr(type(given), "from_numpy", lambda same: same.view(_Results))
    return from_numpy(array)


class RaycastingScene:
    """Triangle meshes, and queries of rays and points.

    nthreads: the threads of the device, 0 for all of the machine
    device:   None, or one whose name begins with "CPU"; or what morphray.Scene takes
    rule:     which points are inside: "odd" numbers of crossings, as in Open3D, or "nonzero", for which
              overlapping meshes are one

    rays are (..., 6) float32, org and dir, and query_points (..., 3) float32. Axes in front are kept in
    the results. nthreads and nsamples of the methods have no effect: inside is exact. Unlike in Open3D,
    each crossing of a surface is listed and counted once, also through edges and vertices.

    Any number of threads may use a scene at the same time. Queries that begin after add_triangles() see
    its triangles.
    """

    INVALID_ID: int = _morphray.INVALID_ID

    def __init__(self, nthreads: int = 0, device: Any = None, *, rule: str = "odd") -> None:
        if device is None or str(device).upper().startswith("CPU"):
            device = _morphray.Device.cpu(threads=nthreads)
        # One device for all scenes.
        self._device = _morphray.Scene([], device=device).device
        self._rule = rule
        self._meshes: List[Any] = []
        self._built = None
        self._lock = _threading.Lock()

    def add_triangles(self, vertex_positions: Any, triangle_indices: Any = None) -> int:
        """Adds a mesh, which is copied, and returns its geometry ID: 0, 1, ... in order.

        vertex_positions: (V, 3) float32; or, alone, a TriangleMesh of o3d.t.geometry
        triangle_indices: (T, 3) integers
        """
        if triangle_indices is None:
            mesh = vertex_positions
            if not hasattr(mesh, "vertex") or not hasattr(mesh, "triangle"):
                raise TypeError("add_triangles: positions and indices are needed, or a "
                                f"o3d.t.geometry.TriangleMesh, not {type(mesh).__name__}")
            vertex_positions, triangle_indices = mesh.vertex.positions, mesh.triangle.indices
        arrays = (_array(vertex_positions), _array(triangle_indices))
        points, triangles = (a.copy(order="C") if isinstance(a, np.ndarray) else a for a in arrays)
        # Finds what is wrong with it now.
        _morphray.Scene([], device="brute").attach(points, triangles)
        with self._lock:
            self._meshes.append(_morphray.Mesh(points, triangles, deforms=False))
            self._built = None
            return len(self._meshes) - 1

    def _scene(self):
        with self._lock:
            if self._built is None:
                self._built = _morphray.Scene(self._meshes, device=self._device, update="refit")
            return self._built

    def cast_rays(self, rays: Any, nthreads: int = 0, *,
                  excluded: Any = None) -> Dict[str, NDArray[Any]]:
        """Finds the closest hits. Returns a dict of t_hit (inf for a miss), geometry_ids,
        primitive_ids (INVALID_ID for a miss), primitive_uvs, and primitive_normals of length 1.

        excluded: (..., 2) geometry and primitive IDs: for each ray a triangle that it leaves out
        """
        array, coherence = _rays(rays)
        scene = self._scene()
        hits = scene.intersect(array, coherence=coherence, excluded=excluded)
        return _results({"t_hit": hits["t"].copy(), **_primitives(hits),
                         "primitive_normals": scene.normals(hits)}, rays)

    def test_occlusions(self, rays: Any, tnear: float = 0.0, tfar: float = np.inf,
                        nthreads: int = 0, *, excluded: Any = None) -> NDArray[np.bool_]:
        """Finds whether rays hit anything at tnear <= t <= tfar; excluded as in cast_rays()."""
        array, coherence = _rays(rays)
        if tnear != 0 or tfar != np.inf:
            limited = np.empty(array.shape[:-1] + (8,), array.dtype)
            limited[..., :3], limited[..., 3] = array[..., :3], tnear
            limited[..., 4:7], limited[..., 7] = array[..., 3:], tfar
            array = limited
        occluded = self._scene().occluded(array, coherence=coherence, excluded=excluded)
        return _results(occluded, rays)

    def count_intersections(self, rays: Any, nthreads: int = 0) -> NDArray[np.int32]:
        """Counts all hits of rays."""
        array, coherence = _rays(rays)
        return _results(self._scene().count(array, coherence=coherence).astype(np.int32), rays)

    def list_intersections(self, rays: Any, nthreads: int = 0) -> Dict[str, NDArray[Any]]:
        """Finds all hits of rays, in ascending order of t for each ray. Returns a dict of

        ray_splits: (N + 1,) uint32: ray i has the hits from ray_splits[i] to ray_splits[i + 1]
        ray_ids:    (H,) uint32: the ray of each hit, counted over all axes in front
        t_hit, geometry_ids, primitive_ids, primitive_uvs: those of cast_rays()
        """
        all_hits = self._scene().intersect_all(_rays(rays)[0])
        hits = all_hits.hits
        return _results({"ray_splits": all_hits.offsets.astype(np.uint32),
                         "ray_ids": all_hits.ray_ids.astype(np.uint32),
                         "t_hit": hits["t"].copy(), **_primitives(hits)}, rays)

    def compute_closest_points(self, query_points: Any,
                               nthreads: int = 0) -> Dict[str, NDArray[Any]]:
        """Finds the closest points of the meshes. Returns a dict of points, geometry_ids,
        primitive_ids (the lowest of equally close triangles), primitive_uvs and primitive_normals.
        Where there is none, as for a point that is not finite, IDs are INVALID_ID, and all else 0.
        """
        scene = self._scene()
        closest = scene.closest_points(_array(query_points))
        return _results({"points": closest["point"].copy(), **_primitives(closest),
                         "primitive_normals": scene.normals(closest)}, query_points)

    def compute_distance(self, query_points: Any, nthreads: int = 0) -> NDArray[np.float32]:
        """Finds the distances to the meshes. inf where there is none."""
        closest = self._scene().closest_points(_array(query_points))
        return _results(closest["distance"].copy(), query_points)

    def compute_signed_distance(self, query_points: Any, nthreads: int = 0,
                                nsamples: int = 1) -> NDArray[np.float32]:
        """The distances to the meshes, negative inside (compute_occupancy()). NaN for a point that
        is not finite."""
        distances = self._scene().signed_distance(_array(query_points), rule=self._rule)
        return _results(distances, query_points)

    def compute_occupancy(self, query_points: Any, nthreads: int = 0,
                          nsamples: int = 1) -> NDArray[np.float32]:
        """Finds which points are inside by `rule`, as Scene.contains(): 1 inside or on a triangle, 0
        outside. Meshes with holes have no inside."""
        inside = self._scene().contains(_array(query_points), rule=self._rule)
        return _results(inside.astype(np.float32), query_points)

    @staticmethod
    def create_rays_pinhole(*args: Any, **kwargs: Any) -> NDArray[np.float32]:
        """The rays of a pinhole camera through the middles of pixels: (height_px, width_px, 6).

        create_rays_pinhole(intrinsic_matrix, extrinsic_matrix, width_px, height_px): (3, 3), upper
        triangular, and (4, 4), from the world to the camera.
        create_rays_pinhole(fov_deg, center, eye, up, width_px, height_px): the horizontal field of
        view in degrees, and three points of three numbers.

        Directions have the length 1 along the axis of the camera. Where up is parallel to the view,
        z takes its place, or y for a view mainly along z. Raises ValueError for center at eye, up 0,
        and numbers that are not finite.
        """
        given = (*args, *kwargs.values())
        rays = (_rays_of_matrices(*args, **kwargs) if len(given) == 4
                else _rays_of_view(*args, **kwargs))
        return _results(rays, next((a for a in given if hasattr(type(a), "from_numpy")), None))


def _rays_of_matrices(intrinsic_matrix, extrinsic_matrix, width_px, height_px):
    intrinsic = _matrix(intrinsic_matrix, "intrinsic_matrix", (3, 3))
    extrinsic = _matrix(extrinsic_matrix, "extrinsic_matrix", (4, 4))
    to_world = extrinsic[:3, :3].T
    x, y = np.meshgrid(np.arange(width_px) + 0.5, np.arange(height_px) + 0.5)
    rays = np.empty((height_px, width_px, 6), np.float32)
    rays[..., :3] = -to_world @ extrinsic[:3, 3]
    rays[..., 3:] = np.stack([x, y, np.ones_like(x)], axis=-1) @ (
        to_world @ np.linalg.inv(intrinsic)).T
    if not np.isfinite(rays).all():
        raise ValueError("create_rays_pinhole: numbers are not finite, or too large for float32")
    return rays


def _rays_of_view(fov_deg, center, eye, up, width_px, height_px):
    origin, above = _matrix(eye, "eye", (3,)), _matrix(up, "up", (3,))
    ahead = _matrix(center, "center", (3,)) - origin
    if not ahead.any():
        raise ValueError(f"eye and center are both {origin}; move one of them")
    if not above.any():
        raise ValueError(f"up: {above} has no direction; give another")
    if not 0 < fov_deg < 180:
        raise ValueError(f"fov_deg: {fov_deg} is not above 0 and below 180")
    right = np.cross(above, ahead)
    if np.linalg.norm(right) <= _PARALLEL * np.linalg.norm(above) * np.linalg.norm(ahead):
        right = np.cross([0, 1, 0] if np.abs(ahead).argmax() == 2 else [0, 0, 1], ahead)
    rows = [row / np.linalg.norm(row) for row in (right, np.cross(ahead, right), ahead)]
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = rows
    extrinsic[:3, 3] = -extrinsic[:3, :3] @ origin
    focal_length = 0.5 * width_px / np.tan(0.5 * np.deg2rad(fov_deg))
    intrinsic = [[focal_length, 0, 0.5 * width_px], [0, focal_length, 0.5 * height_px], [0, 0, 1]]
    return _rays_of_matrices(intrinsic, extrinsic, width_px, height_px)
