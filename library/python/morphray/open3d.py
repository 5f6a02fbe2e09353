"""Open3D's RaycastingScene over morphray: its names, arguments, keys and dtypes.

    import morphray.open3d

    scene = morphray.open3d.RaycastingScene()     # instead of o3d.t.geometry.RaycastingScene()
    scene.add_triangles(mesh)
    distances = scene.compute_signed_distance(points)

Arrays are numpy's; tensors of Open3D are accepted, and so are its meshes. Open3D is not imported.
"""

import operator as _operator
import threading as _threading

import numpy as np

import morphray as _morphray


def _array(tensor):
    """A tensor of Open3D as an array; all else as it is."""
    if isinstance(tensor, np.ndarray) or not hasattr(tensor, "numpy"):
        return tensor
    return (tensor.cpu() if hasattr(tensor, "cpu") else tensor).numpy()


def _coherence(rays):
    """Rays of (height, width, 6), as create_rays_pinhole() makes them, are those of an image."""
    return rays.shape[1] if getattr(rays, "ndim", 0) == 3 else "sort"


def _require_count(number, name, least):
    count = _operator.index(number)
    if count < least:
        raise ValueError(f"{name}: {count} is below {least}")
    return count


def _require_samples(nsamples):
    if _require_count(nsamples, "nsamples", 1) % 2 == 0:
        raise ValueError(f"nsamples: an odd number is needed, not {nsamples}")


def _device_of(device, nthreads):
    if device is None or str(device).upper().startswith("CPU"):
        return _morphray.Device.cpu(threads=nthreads)
    return device


def _matrix(array, name, shape):
    matrix = np.asarray(_array(array), np.float64)
    if matrix.shape != shape:
        raise ValueError(f"{name}: a shape of {shape} is needed, not {matrix.shape}")
    return matrix


class RaycastingScene:
    """Triangle meshes, and questions about rays and points.

    nthreads: the threads of the device, 0 for all of the machine
    device:   None, or one whose name begins with "CPU"; or what morphray.Scene takes, "vulkan" among
              others: answers have the same bits

    rays are (..., 6) float32: org and dir, and t is in units of dir. Those of (height, width, 6) are
    traced as an image's, others are sorted, for speed alone. Hits have t > 0: a ray that
    starts on a triangle does not hit it there. query_points are (..., 3) float32. Axes in front are
    kept in the results. The argument nthreads of the methods is checked and has no effect, since the
    device has its threads.

    Unlike in Open3D, each crossing of a surface is listed and counted once (Scene.intersect_all()
    has the rule), also through edges and vertices, and inside is exact; see compute_occupancy().

    Any number of threads may use a scene at the same time: what add_triangles() adds is there for
    questions that begin afterwards. Ctrl-C ends long questions.

    Raises TypeError for arrays of another dtype, ValueError for other shapes, morphray.Error for
    what the library finds.
    """

    INVALID_ID = _morphray.INVALID_ID

    def __init__(self, nthreads=0, device=None):
        device = _device_of(device, _require_count(nthreads, "nthreads", 0))
        # One device for all scenes that are to be built.
        self._device = _morphray.Scene([], device=device).device
        self._meshes = []
        self._scene = None
        self._lock = _threading.Lock()

    def add_triangles(self, vertex_positions, triangle_indices=None):
        """Adds a mesh, which is copied, and returns its geometry ID: 0, 1, ... in order.

        vertex_positions: (V, 3) float32; or, alone, a TriangleMesh of o3d.t.geometry
        triangle_indices: (T, 3) uint32, int32, uint64 or int64

        The next question builds the scene anew. Raises Error "bad_input" for an index that is out
        of range.
        """
        if triangle_indices is None:
            mesh = vertex_positions
            if not hasattr(mesh, "vertex") or not hasattr(mesh, "triangle"):
                raise TypeError("add_triangles: positions and indices are needed, or a "
                                f"o3d.t.geometry.TriangleMesh, not {type(mesh).__name__}")
            vertex_positions, triangle_indices = mesh.vertex.positions, mesh.triangle.indices
        points, triangles = _array(vertex_positions), _array(triangle_indices)
        if isinstance(points, np.ndarray):
            points = points.copy(order="C")
        if isinstance(triangles, np.ndarray):
            triangles = triangles.copy(order="C")
        mesh = _morphray.Mesh(points, triangles, deforms=False)
        # Finds what is wrong with it now.
        _morphray.Scene([mesh], device="brute")
        with self._lock:
            self._meshes = self._meshes + [mesh]
            self._scene = None
            return len(self._meshes) - 1

    def _built(self):
        with self._lock:
            if self._scene is None:
                self._scene = _morphray.Scene(self._meshes, device=self._device, update="refit")
            return self._scene

    def cast_rays(self, rays, nthreads=0):
        """Finds the closest hits. Returns the dict of morphray.Scene.cast_rays()."""
        _require_count(nthreads, "nthreads", 0)
        rays = _array(rays)
        return self._built().cast_rays(rays, coherence=_coherence(rays))

    def test_occlusions(self, rays, tnear=0.0, tfar=np.inf, nthreads=0):
        """Finds whether rays hit anything at tnear <= t <= tfar: bool, one a ray."""
        _require_count(nthreads, "nthreads", 0)
        rays = _array(rays)
        return self._built().test_occlusions(rays, tnear, tfar, coherence=_coherence(rays))

    def count_intersections(self, rays, nthreads=0):
        """Counts all hits of rays: int32, one a ray."""
        _require_count(nthreads, "nthreads", 0)
        rays = _array(rays)
        return self._built().count(rays, coherence=_coherence(rays)).astype(np.int32)

    def list_intersections(self, rays, nthreads=0):
        """Finds all hits of rays. Returns a dict of

        ray_splits:    (N + 1,) uint32: those of ray i have the numbers from ray_splits[i] on, up to
                       ray_splits[i + 1], which is the first one of the next ray
        ray_ids:       (H,) uint32: the ray of each hit, counted over all axes in front
        t_hit:         (H,) float32, in ascending order for each ray
        geometry_ids:  (H,) uint32
        primitive_ids: (H,) uint32
        primitive_uvs: (H, 2) float32
        """
        _require_count(nthreads, "nthreads", 0)
        all_hits = self._built().intersect_all(_array(rays))
        if len(all_hits.hits) > 0xFFFFFFFF:
            raise ValueError(f"list_intersections: {len(all_hits.hits)} hits are more than uint32 "
                             "counts; morphray.Scene.intersect_all() has no such limit")
        hits = all_hits.hits
        return {
            "ray_splits": all_hits.offsets.astype(np.uint32),
            "ray_ids": all_hits.ray_ids.astype(np.uint32),
            "t_hit": hits["t"].copy(),
            "geometry_ids": hits["geom_id"].copy(),
            "primitive_ids": hits["prim_id"].copy(),
            "primitive_uvs": np.stack([hits["u"], hits["v"]], axis=-1),
        }

    def compute_closest_points(self, query_points, nthreads=0):
        """Finds the closest points of the meshes. Returns a dict of

        points:            (..., 3) float32
        geometry_ids:      (...) uint32
        primitive_ids:     (...) uint32: of equally close triangles the lowest
        primitive_uvs:     (..., 2) float32
        primitive_normals: (..., 3) float32, (p1 - p0) x (p2 - p0) with length 1; 0 for a triangle
                           without area

        Where there is none, in an empty scene or for a point that is NaN or infinite, IDs are
        INVALID_ID and all else is 0.
        """
        _require_count(nthreads, "nthreads", 0)
        closest = self._built().closest_points(_array(query_points))
        return {
            "points": closest["point"].copy(),
            "geometry_ids": closest["geom_id"].copy(),
            "primitive_ids": closest["prim_id"].copy(),
            "primitive_uvs": np.stack([closest["u"], closest["v"]], axis=-1),
            "primitive_normals": self._normals(closest["geom_id"], closest["prim_id"]),
        }

    def _normals(self, geom_ids, prim_ids):
        normals = np.zeros(geom_ids.shape + (3,), np.float32)
        for geom_id, mesh in enumerate(self._meshes):
            here = geom_ids == geom_id
            if not here.any():
                continue
            corners = mesh.points[mesh.triangles[prim_ids[here]]].astype(np.float64)
            n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            length = np.linalg.norm(n, axis=1, keepdims=True)
            normals[here] = np.divide(n, length, out=np.zeros_like(n), where=length > 0)
        return normals

    def compute_distance(self, query_points, nthreads=0):
        """Finds the distances to the meshes: float32, one a point. inf where there is none."""
        _require_count(nthreads, "nthreads", 0)
        return self._built().closest_points(_array(query_points))["distance"].copy()

    def compute_signed_distance(self, query_points, nthreads=0, nsamples=1):
        """The distances to the meshes, negative inside, as compute_occupancy() says: float32.

        inf where there is none, NaN for a point that is NaN or infinite.
        """
        _require_count(nthreads, "nthreads", 0)
        _require_samples(nsamples)
        return self._built().signed_distance(_array(query_points), rule="odd")

    def compute_occupancy(self, query_points, nthreads=0, nsamples=1):
        """Finds which points are inside: float32, 1 inside and 0 outside.

        A point is inside if a half-line from it crosses the meshes an odd number of times, exactly,
        or if it lies on a triangle. nsamples is checked to be odd and has no effect, since there is
        no doubt that votes would decide. Meshes with holes have no inside.
        """
        _require_count(nthreads, "nthreads", 0)
        _require_samples(nsamples)
        return self._built().contains(_array(query_points), rule="odd").astype(np.float32)

    @staticmethod
    def create_rays_pinhole(*args, **kwargs):
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
    width = _require_count(width_px, "width_px", 0)
    height = _require_count(height_px, "height_px", 0)
    to_world = extrinsic[:3, :3].T
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    rays = np.empty((height, width, 6), np.float32)
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
