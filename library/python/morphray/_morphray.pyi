# The types of the extension module, without documentation: that is in the module. Arrays of hits, closest points and
# differences are structured: NDArray[np.void].
from os import PathLike
from typing import Any, Final, Literal, Protocol, Sequence, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import AllHits, Crossings

class _DLPack(Protocol):
    def __dlpack__(self, *args: Any, **kwargs: Any) -> Any: ...

_Array = ArrayLike | _DLPack
_Point = Sequence[float] | NDArray[Any]
_Device = Device | Literal["cpu", "vulkan", "brute"]
_Coherence = Literal["none", "sort"] | int
_Crossing = Literal["once", "each", "owner"]
_Rule = Literal["nonzero", "odd"]
_Threads = Literal["all", "calling"]

DIGEST: int
__version__: str
INVALID_ID: int
ray_dtype: np.dtype[np.void]
hit_dtype: np.dtype[np.void]
closest_dtype: np.dtype[np.void]

def simd_targets() -> list[str]: ...
def vulkan_devices() -> list[VulkanDeviceInfo]: ...
@overload
def compare(first: Scene, second: Scene, rays: _Array, keep: int = 10) -> Comparison: ...
@overload
def compare(first: Image, second: Image, rays: None = None, keep: int = 10) -> Comparison: ...

class Error(RuntimeError):
    code: str

class Cancel:
    def __init__(self) -> None: ...
    def set(self) -> None: ...
    def clear(self) -> None: ...
    def is_set(self) -> bool: ...

class Device:
    @staticmethod
    def cpu(threads: int = 0, simd: str = "") -> Device: ...
    @staticmethod
    def vulkan(device: str = "", validate: bool = False) -> Device: ...
    @staticmethod
    def brute_force(threads: int = 0, simd: str = "") -> Device: ...
    name: Final[str]
    description: Final[str]
    def digest(self) -> int: ...

class VulkanDeviceInfo:
    index: Final[int]
    name: Final[str]
    type: Final[str]
    driver: Final[str]
    uuid: Final[str]
    memory_bytes: Final[int]
    unusable: Final[str]

class Image:
    width: Final[int]
    height: Final[int]
    samples: Final[int]
    pixels: Final[NDArray[np.uint8]]
    hits: Final[NDArray[np.void]]
    occlusion: Final[NDArray[np.uint32]]
    ray_count: Final[int]
    trace_ms: Final[float]
    hits_hash: Final[int]
    image_hash: Final[int]
    def save(self, path: str | PathLike[str]) -> None: ...
    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]: ...

class Comparison:
    compared: Final[int]
    different: Final[int]
    equal: Final[bool]
    differences: Final[NDArray[np.void]]
    def __bool__(self) -> bool: ...

class LeftOut:
    geom_id: Final[int]
    not_finite: Final[int]
    too_far: Final[int]
    too_small: Final[int]

class Update:
    step: Final[str]
    reason: Final[str]
    cost_ratio: Final[float]
    build_pending: Final[bool]
    left_out: Final[list[LeftOut]]
    milliseconds: Final[float]
    read_ms: Final[float]
    upload_ms: Final[float]
    refit_ms: Final[float]
    decide_ms: Final[float]
    restructure_ms: Final[float]
    rebuild_ms: Final[float]

class EdgeCounts:
    open: Final[int]
    shared: Final[int]
    turned: Final[int]
    uneven: Final[int]
    twins: Final[int]
    is_closed: Final[bool]

class TreeStatistics:
    sah_cost: Final[float]
    node_count: Final[int]
    leaf_count: Final[int]
    depth: Final[int]
    bytes: Final[int]
    hash: Final[int]

class Scene:
    def __init__(self, points: _Array | Sequence[Sequence[Any]], triangles: _Array | None = None, *,
                 device: _Device = "cpu", bounds: tuple[_Point, _Point] | None = None, update: str = "auto",
                 budget_ms: float = 0.0, budget: float = 0.75, deterministic: bool = False, deforms: bool = True,
                 albedo: _Array | None = None, record_cost_ratio: bool = False,
                 textures: tuple[Any, ...] | None = None, origin: _Point | None = None) -> None: ...
    @overload
    def update(self, geom_id: int | None = None, first: int = 0, count: int | None = None) -> Update: ...
    @overload
    def update(self, geom_id: int, points: _Array) -> Update: ...
    @overload
    def update(self, *, poses: _Array, geom_ids: _Array) -> Update: ...
    def update_with_new_bounds(self) -> Update: ...
    def attach(self, points: _Array, triangles: _Array, deforms: bool = True, albedo: _Array | None = None,
               textures: tuple[Any, ...] | None = None) -> int: ...
    def detach(self, geom_id: int) -> None: ...
    def last_update(self) -> Update: ...
    def edge_counts(self) -> EdgeCounts: ...
    def tree_statistics(self) -> TreeStatistics: ...
    def on(self, device: _Device) -> Scene: ...
    def render(self, size: tuple[int, int] = (1024, 1024), *, eye: _Point | None = None,
               target: _Point | None = None, up: _Point = (0.0, 1.0, 0.0), fov: float = 45.0,
               light: _Point | None = None, rays: Literal["primary", "shadow", "ao"] = "primary",
               ao_count: int = 16, ao_distance: float = 0.0,
               shading: Literal["plain", "lit", "normal", "depth", "prim"] = "plain",
               samples: int = 1, flat: bool = False, cancel: Cancel | None = None) -> Image: ...
    def render_views(self, eyes: _Array | None = None, targets: _Array | None = None, *,
                     camera_to_world: _Array | None = None, intrinsics: _Array | None = None,
                     convention: Literal["opencv", "opengl"] = "opencv", up: _Array = (0, 1, 0), fov: float = 45.0,
                     size: tuple[int, int] = (64, 64), channels: str | Sequence[str] = ("depth",),
                     out: dict[str, NDArray[Any]] | None = None,
                     cancel: Cancel | None = None) -> dict[str, NDArray[Any]]: ...
    def intersect(self, rays: _Array, out: NDArray[np.void] | None = None, *, coherence: _Coherence = "none",
                  visible: _Array | None = None, excluded: _Array | None = None, threads: _Threads = "all",
                  cancel: Cancel | None = None) -> NDArray[np.void]: ...
    def occluded(self, rays: _Array, out: NDArray[np.bool_] | None = None, *, coherence: _Coherence = "none",
                 visible: _Array | None = None, excluded: _Array | None = None, threads: _Threads = "all",
                 cancel: Cancel | None = None) -> NDArray[np.bool_]: ...
    def intersect_all(self, rays: _Array, *, crossing: _Crossing = "once", max_hits: int | None = None,
                      visible: _Array | None = None, excluded: _Array | None = None, threads: _Threads = "all",
                      cancel: Cancel | None = None) -> AllHits: ...
    def count(self, rays: _Array, out: NDArray[np.int64] | None = None, *, crossing: _Crossing = "once",
              coherence: _Coherence = "none", visible: _Array | None = None, excluded: _Array | None = None,
              threads: _Threads = "all", cancel: Cancel | None = None) -> NDArray[np.int64]: ...
    def normals(self, hits: NDArray[np.void], smooth: bool = False) -> NDArray[np.float32]: ...
    def winding(self, points: _Array, out: NDArray[np.int32] | None = None, *, visible: _Array | None = None,
                excluded: _Array | None = None, threads: _Threads = "all",
                cancel: Cancel | None = None) -> NDArray[np.int32]: ...
    def contains(self, points: _Array, out: NDArray[np.bool_] | None = None, *, rule: _Rule = "nonzero",
                 visible: _Array | None = None, excluded: _Array | None = None, threads: _Threads = "all",
                 cancel: Cancel | None = None) -> NDArray[np.bool_]: ...
    def closest_points(self, points: _Array, max_distance: float | None = None,
                       out: NDArray[np.void] | None = None, *, visible: _Array | None = None,
                       excluded: _Array | None = None, threads: _Threads = "all",
                       cancel: Cancel | None = None) -> NDArray[np.void]: ...
    def signed_distance(self, points: _Array, out: NDArray[np.float32] | None = None, *, rule: _Rule = "nonzero",
                        max_distance: float | None = None, visible: _Array | None = None,
                        excluded: _Array | None = None, threads: _Threads = "all",
                        cancel: Cancel | None = None) -> NDArray[np.float32]: ...
    @overload
    def crossings(self, geom_ids: _Array | None = None, other: _Array | None = None, *, limit: int | None = None,
                  count: Literal[False] = False, visible: _Array | None = None, threads: _Threads = "all",
                  cancel: Cancel | None = None) -> Crossings: ...
    @overload
    def crossings(self, geom_ids: _Array | None = None, other: _Array | None = None, *, limit: int | None = None,
                  count: Literal[True], visible: _Array | None = None, threads: _Threads = "all",
                  cancel: Cancel | None = None) -> int: ...
    def has_crossings(self, geom_ids: _Array | None = None, other: _Array | None = None, *,
                      visible: _Array | None = None, threads: _Threads = "all",
                      cancel: Cancel | None = None) -> bool: ...
    device: Final[Device]
    bounds: Final[tuple[NDArray[np.float64], NDArray[np.float64]]]
    origin: Final[NDArray[np.float64]]
    triangle_count: Final[int]
    vertex_count: Final[int]
