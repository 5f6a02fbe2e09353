from typing import Any, TypedDict, Union, overload

import numpy as np
from numpy.typing import NDArray

from morphray import Device, _CastHits

class _ListedHits(TypedDict):
    ray_splits: NDArray[np.uint32]
    ray_ids: NDArray[np.uint32]
    t_hit: NDArray[np.float32]
    geometry_ids: NDArray[np.uint32]
    primitive_ids: NDArray[np.uint32]
    primitive_uvs: NDArray[np.float32]

class _Closest(TypedDict):
    points: NDArray[np.float32]
    geometry_ids: NDArray[np.uint32]
    primitive_ids: NDArray[np.uint32]
    primitive_uvs: NDArray[np.float32]
    primitive_normals: NDArray[np.float32]

class RaycastingScene:
    INVALID_ID: int
    def __init__(self, nthreads: int = 0, device: Union[Device, str, Any, None] = None) -> None: ...
    # Arrays, or tensors of Open3D, which has no stubs.
    def add_triangles(self, vertex_positions: Any, triangle_indices: Any = None) -> int: ...
    def cast_rays(self, rays: Any, nthreads: int = 0) -> _CastHits: ...
    def test_occlusions(
        self, rays: Any, tnear: float = 0.0, tfar: float = ..., nthreads: int = 0
    ) -> NDArray[np.bool_]: ...
    def count_intersections(self, rays: Any, nthreads: int = 0) -> NDArray[np.int32]: ...
    def list_intersections(self, rays: Any, nthreads: int = 0) -> _ListedHits: ...
    def compute_closest_points(self, query_points: Any, nthreads: int = 0) -> _Closest: ...
    def compute_distance(self, query_points: Any, nthreads: int = 0) -> NDArray[np.float32]: ...
    def compute_signed_distance(
        self, query_points: Any, nthreads: int = 0, nsamples: int = 1
    ) -> NDArray[np.float32]: ...
    def compute_occupancy(
        self, query_points: Any, nthreads: int = 0, nsamples: int = 1
    ) -> NDArray[np.float32]: ...
    @overload
    @staticmethod
    def create_rays_pinhole(
        intrinsic_matrix: Any, extrinsic_matrix: Any, width_px: int, height_px: int
    ) -> NDArray[np.float32]: ...
    @overload
    @staticmethod
    def create_rays_pinhole(
        fov_deg: float, center: Any, eye: Any, up: Any, width_px: int, height_px: int
    ) -> NDArray[np.float32]: ...
