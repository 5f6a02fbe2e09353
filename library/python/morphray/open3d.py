"""Open3D's RaycastingScene over morphray: its names, arguments, keys and dtypes.

    import morphray.open3d

    scene = morphray.open3d.RaycastingScene()     # instead of o3d.t.geometry.RaycastingScene()
    scene.add_triangles(mesh)
    distances = scene.compute_signed_distance(points)

Arrays are numpy's, with a method numpy() as tensors have it; tensors of Open3D are accepted, and so
are its meshes. Open3D is not imported.
"""

import threading as _threading
from typing import Any, Dict, List

import numpy as np
from numpy.typing import NDArray

import morphray as _morphray


def _array(tensor):
    """A tensor of Open3D as an array; all else as it is."""
    if isinstance(tensor, np.ndarray) or not hasattr(tensor, "numpy"):
        return tensor
    return (tensor.cpu() if hasattr(tensor, "cpu") else tensor).numpy()


def _rays(tensor):
    """Rays, and their coherence: those of (height, width, 6) are those of an image, as
    create_rays_pinhole() makes them."""
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
        "geometry_ids": _results(hits["geom_id"].copy()),
        "primitive_ids": _results(hits["prim_id"].copy()),
        "primitive_uvs": _results(np.stack([hits["u"], hits["v"]], axis=-1)),
    }


class _Results(np.ndarray):
    """An array that scripts may also call numpy() of, as of a tensor."""

    def numpy(self) -> NDArray[Any]:
        return np.asarray(self)


def _results(array):
    return array.view(_Results)


class RaycastingScene:
    """Triangle meshes, and queries of rays and points.

    nthreads: the threads of the device, 0 for all of the machine
    device:   None, or one whose name begins with "CPU"; or what morphray.Scene takes

    rays are (..., 6) float32, org and dir, and query_points (..., 3) float32. Axes in front are kept in
    the results. The arguments nthreads and nsamples of the methods have no effect: the device has its
    threads, and inside is exact. Unlike in Open3D, each crossing of a surface is
    listed and counted once, also through edges and vertices.

    Any number of threads may use a scene at the same time: what add_triangles() adds is there for
    queries that begin afterwards.
    """

    INVALID_ID: int = _morphray.INVALID_ID

    def __init__(self, nthreads: int = 0, device: Any = None) -> None:
        if device is None or str(device).upper().startswith("CPU"):
            device = _morphray.Device.cpu(threads=nthreads)
        # One device for all scenes that are to be built.
        self._device = _morphray.Scene([], device=device).device
        self._meshes: List[Any] = []
        self._built = None
        self._lock = _threading.Lock()

    def add_triangles(self, vertex_positions: Any, triangle_indices: Any = None) -> int:
        """Adds a mesh, which is copied, and returns its geometry ID: 0, 1, ... in order.

        vertex_positions: (V, 3) float32; or, alone, a TriangleMesh of o3d.t.geometry
        triangle_indices: (T, 3) uint32, int32, uint64 or int64
        """
        if triangle_indices is None:
            mesh = vertex_positions
            if not hasattr(mesh, "vertex") or not hasattr(mesh, "triangle"):
                raise TypeError("add_triangles: positions and indices are needed, or a "
                                f"o3d.t.geometry.TriangleMesh, not {type(mesh).__name__}")
            vertex_positions, triangle_indices = mesh.vertex.positions, mesh.triangle.indices
        arrays = (_array(vertex_positions), _array(triangle_indices))
        points, triangles = (a.copy(order="C") if isinstance(a, np.ndarray) else a for a in arrays)
        mesh = _morphray.Mesh(points, triangles, deforms=False)
        # Finds what is wrong with it now.
        _morphray.Scene([], device="brute").attach(points, triangles)
        with self._lock:
            self._meshes.append(mesh)
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
        return {
            "t_hit": _results(hits["t"].copy()),
            **_primitives(hits),
            "primitive_normals": _results(scene.normals(hits)),
        }

    def test_occlusions(self, rays: Any, tnear: float = 0.0, tfar: float = np.inf,
                        nthreads: int = 0, *, excluded: Any = None) -> NDArray[np.bool_]:
        """Finds whether rays hit anything at tnear <= t <= tfar; excluded as in cast_rays()."""
        array, coherence = _rays(rays)
        if tnear != 0 or tfar != np.inf:
            limited = np.empty(array.shape[:-1] + (8,), array.dtype)
            limited[..., :3], limited[..., 3] = array[..., :3], tnear
            limited[..., 4:7], limited[..., 7] = array[..., 3:], tfar
            array = limited
        return _results(self._scene().occluded(array, coherence=coherence, excluded=excluded))

    def count_intersections(self, rays: Any, nthreads: int = 0) -> NDArray[np.int32]:
        """Counts all hits of rays."""
        array, coherence = _rays(rays)
        return _results(self._scene().count(array, coherence=coherence).astype(np.int32))

    def list_intersections(self, rays: Any, nthreads: int = 0) -> Dict[str, NDArray[Any]]:
        """Finds all hits of rays, in ascending order of t for each ray. Returns a dict of

        ray_splits: (N + 1,) uint32: the hits of ray i are those from ray_splits[i] to
                    ray_splits[i + 1]
        ray_ids:    (H,) uint32: the ray of each hit, counted over all axes in front
        t_hit, geometry_ids, primitive_ids, primitive_uvs: those of cast_rays()
        """
        all_hits = self._scene().intersect_all(_rays(rays)[0])
        hits = all_hits.hits
        if len(hits) > 0xFFFFFFFF:
            raise ValueError(f"list_intersections: {len(hits)} hits are more than uint32 counts; "
                             "morphray.Scene.intersect_all() has no such limit")
        return {
            "ray_splits": _results(all_hits.offsets.astype(np.uint32)),
            "ray_ids": _results(all_hits.ray_ids.astype(np.uint32)),
            "t_hit": _results(hits["t"].copy()),
            **_primitives(hits),
        }

    def compute_closest_points(self, query_points: Any,
                               nthreads: int = 0) -> Dict[str, NDArray[Any]]:
        """Finds the closest points of the meshes. Returns a dict of points, geometry_ids,
        primitive_ids (the lowest of equally close triangles), primitive_uvs and primitive_normals.

        Where there is none, in an empty scene or for a point that is NaN or infinite, IDs are
        INVALID_ID and all else is 0.
        """
        scene = self._scene()
        closest = scene.closest_points(_array(query_points))
        return {
            "points": _results(closest["point"].copy()),
            **_primitives(closest),
            "primitive_normals": _results(scene.normals(closest)),
        }

    def compute_distance(self, query_points: Any, nthreads: int = 0) -> NDArray[np.float32]:
        """Finds the distances to the meshes. inf where there is none."""
        return _results(self._scene().closest_points(_array(query_points))["distance"].copy())

    def compute_signed_distance(self, query_points: Any, nthreads: int = 0,
                                nsamples: int = 1) -> NDArray[np.float32]:
        """The distances to the meshes, negative inside, as compute_occupancy() says. NaN for a
        point that is NaN or infinite."""
        return _results(self._scene().signed_distance(_array(query_points)))

    def compute_occupancy(self, query_points: Any, nthreads: int = 0,
                          nsamples: int = 1) -> NDArray[np.float32]:
        """Finds which points are inside: 1 inside and 0 outside.

        A point is inside if the meshes wind around it, exactly, as Scene.contains() says, or if it
        lies on a triangle. Overlapping meshes count as one. Meshes with holes have no inside.
        """
        return _results(self._scene().contains(_array(query_points)).astype(np.float32))

    @staticmethod
    def create_rays_pinhole(*args: Any, **kwargs: Any) -> NDArray[np.float32]:
        """The rays of a pinhole camera through the middles of pixels: (height_px, width_px, 6).

        create_rays_pinhole(intrinsic_matrix, extrinsic_matrix, width_px, height_px): (3, 3), upper
        triangular, and (4, 4), from the world to the camera.

        create_rays_pinhole(fov_deg, center, eye, up, width_px, height_px): the horizontal field of
        view in degrees, and three points of three numbers.

        Directions have the length 1 along the axis of the camera.
        """
        if len(args) + len(kwargs) == 4:
            return _rays_of_matrices(*args, **kwargs)
        return _rays_of_view(*args, **kwargs)


def _rays_of_matrices(intrinsic_matrix, extrinsic_matrix, width_px, height_px):
    intrinsic = _matrix(intrinsic_matrix, "intrinsic_matrix", (3, 3))
    extrinsic = _matrix(extrinsic_matrix, "extrinsic_matrix", (4, 4))
    to_world = extrinsic[:3, :3].T
    x, y = np.meshgrid(np.arange(width_px) + 0.5, np.arange(height_px) + 0.5)
    rays = np.empty((height_px, width_px, 6), np.float32)
    rays[..., :3] = -to_world @ extrinsic[:3, 3]
    rays[..., 3:] = np.stack([x, y, np.ones_like(x)], axis=-1) @ (
        to_world @ np.linalg.inv(intrinsic)).T
    return rays


def _rays_of_view(fov_deg, center, eye, up, width_px, height_px):
    centre, origin = _matrix(center, "center", (3,)), _matrix(eye, "eye", (3,))
    down, ahead = _matrix(up, "up", (3,)), centre - origin
    right = np.cross(down, ahead)
    down = np.cross(ahead, right)
    rows = [row / np.linalg.norm(row) for row in (right, down, ahead)]
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = rows
    extrinsic[:3, 3] = -extrinsic[:3, :3] @ origin
    focal_length = 0.5 * width_px / np.tan(0.5 * np.deg2rad(fov_deg))
    intrinsic = [[focal_length, 0, 0.5 * width_px], [0, focal_length, 0.5 * height_px], [0, 0, 1]]
    return _rays_of_matrices(intrinsic, extrinsic, width_px, height_px)
