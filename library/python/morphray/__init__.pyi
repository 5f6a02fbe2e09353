from os import PathLike
from typing import Any, Literal, NamedTuple, Optional, Sequence, Tuple, TypedDict, Union, overload

import numpy as np
from numpy.typing import NDArray

__version__: str
INVALID_ID: int
ray_dtype: np.dtype[np.void]
hit_dtype: np.dtype[np.void]
closest_dtype: np.dtype[np.void]

_Path = Union[str, "PathLike[str]"]
_Point = Union[Sequence[float], NDArray[Any]]
_Bounds = Union[Sequence[_Point], NDArray[Any]]
_Indices = Union[NDArray[np.uint32], NDArray[np.int32], NDArray[np.int64], NDArray[np.uint64]]
_Albedo = Union[NDArray[np.uint8], NDArray[np.uint32]]
_Rays = Union[NDArray[np.float32], NDArray[np.void]]
_Crossing = Literal["owner", "each"]
_Coherence = Union[Literal["none", "sort"], int]
_FillRule = Literal["nonzero", "odd"]
_DeviceLike = Union["Device", Literal["cpu", "vulkan", "brute"]]

class _CastHits(TypedDict):
    t_hit: NDArray[np.float32]
    geometry_ids: NDArray[np.uint32]
    primitive_ids: NDArray[np.uint32]
    primitive_uvs: NDArray[np.float32]
    primitive_normals: NDArray[np.float32]

# That of the classes of pybind11.
class _Type(type): ...

class _Made(metaclass=_Type):
    def __init__(self, *args: Any, **kwargs: Any) -> None: ...

class Error(RuntimeError):
    code: str

class Cancel(metaclass=_Type):
    def __init__(self) -> None: ...
    def set(self) -> None: ...
    def clear(self) -> None: ...
    def is_set(self) -> bool: ...

class Device(_Made):
    @staticmethod
    def cpu(threads: int = 0, simd: str = "") -> Device: ...
    @staticmethod
    def vulkan(device: str = "", validate: bool = False) -> Device: ...
    @staticmethod
    def brute_force(threads: int = 0, simd: str = "") -> Device: ...
    @property
    def name(self) -> str: ...
    @property
    def description(self) -> str: ...

class VulkanDeviceInfo(_Made):
    @property
    def index(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def type(self) -> str: ...
    @property
    def driver(self) -> str: ...
    @property
    def uuid(self) -> str: ...
    @property
    def memory_bytes(self) -> int: ...
    @property
    def unusable(self) -> str: ...

def vulkan_devices() -> list[VulkanDeviceInfo]: ...
def simd_targets() -> list[str]: ...

class Update(_Made):
    @property
    def step(self) -> str: ...
    @property
    def reason(self) -> str: ...
    @property
    def cost_ratio(self) -> float: ...
    @property
    def build_pending(self) -> bool: ...
    @property
    def milliseconds(self) -> float: ...
    @property
    def read_ms(self) -> float: ...
    @property
    def upload_ms(self) -> float: ...
    @property
    def refit_ms(self) -> float: ...
    @property
    def decide_ms(self) -> float: ...
    @property
    def restructure_ms(self) -> float: ...
    @property
    def rebuild_ms(self) -> float: ...

class TreeStatistics(_Made):
    @property
    def sah_cost(self) -> float: ...
    @property
    def node_count(self) -> int: ...
    @property
    def leaf_count(self) -> int: ...
    @property
    def depth(self) -> int: ...
    @property
    def bytes(self) -> int: ...
    @property
    def hash(self) -> int: ...

class Textures(NamedTuple):
    images: Union[NDArray[np.uint8], Sequence[NDArray[np.uint8]]]
    texcoords: NDArray[np.float32]
    ids: Optional[_Indices] = None
    wrap: str = "repeat"
    alpha_cutoff: Union[float, Sequence[float]] = 0.0

_TexturesLike = Union[
    Textures,
    Tuple[Union[NDArray[np.uint8], Sequence[NDArray[np.uint8]]], NDArray[np.float32]],
]

class Mesh(NamedTuple):
    points: NDArray[np.float32]
    triangles: _Indices
    deforms: bool = True
    albedo: Optional[_Albedo] = None
    textures: Optional[_TexturesLike] = None

class AllHits(NamedTuple):
    offsets: NDArray[np.int64]
    hits: NDArray[np.void]
    left_out: NDArray[np.int64]
    def of_ray(self, ray: int) -> NDArray[np.void]: ...
    @property
    def ray_ids(self) -> NDArray[np.int64]: ...

_MeshLike = Union[
    Mesh,
    Tuple[NDArray[np.float32], _Indices],
    Tuple[NDArray[np.float32], _Indices, bool],
    Tuple[NDArray[np.float32], _Indices, bool, Optional[_Albedo]],
    Tuple[NDArray[np.float32], _Indices, bool, Optional[_Albedo], Optional[_TexturesLike]],
]

class Scene(metaclass=_Type):
    def __init__(
        self,
        points: Union[NDArray[np.float32], Sequence[_MeshLike]],
        triangles: Optional[_Indices] = None,
        *,
        device: _DeviceLike = "cpu",
        bounds: Optional[_Bounds] = None,
        update: str = "auto",
        budget_ms: float = 0.0,
        budget: float = 0.75,
        deterministic: bool = False,
        split: Literal["binned", "sweep"] = "binned",
        deforms: bool = True,
        albedo: Optional[_Albedo] = None,
        refit_on: Optional[_DeviceLike] = None,
        record_cost_ratio: bool = False,
        textures: Optional[_TexturesLike] = None,
    ) -> None: ...
    def update(
        self, geom_id: Optional[int] = None, first: int = 0, count: Optional[int] = None
    ) -> Update: ...
    def update_with_new_bounds(self) -> Update: ...
    def attach(
        self,
        points: NDArray[np.float32],
        triangles: _Indices,
        deforms: bool = True,
        albedo: Optional[_Albedo] = None,
        textures: Optional[_TexturesLike] = None,
    ) -> int: ...
    def detach(self, geom_id: int) -> None: ...
    def last_update(self) -> Update: ...
    def intersect(
        self,
        rays: _Rays,
        out: Optional[NDArray[np.void]] = None,
        *,
        coherence: _Coherence = "none",
    ) -> NDArray[np.void]: ...
    def occluded(
        self,
        rays: _Rays,
        out: Optional[NDArray[np.bool_]] = None,
        *,
        coherence: _Coherence = "none",
    ) -> NDArray[np.bool_]: ...
    def cast_rays(self, rays: _Rays, *, coherence: _Coherence = "none") -> _CastHits: ...
    def test_occlusions(
        self,
        rays: _Rays,
        tnear: float = 0.0,
        tfar: Optional[float] = None,
        *,
        coherence: _Coherence = "none",
    ) -> NDArray[np.bool_]: ...
    def intersect_all(
        self,
        rays: _Rays,
        *,
        crossing: _Crossing = "owner",
        max_hits: Optional[int] = None,
        cancel: Optional[Cancel] = None,
    ) -> AllHits: ...
    def count(
        self,
        rays: _Rays,
        out: Optional[NDArray[np.int64]] = None,
        *,
        crossing: _Crossing = "owner",
        coherence: _Coherence = "none",
        cancel: Optional[Cancel] = None,
    ) -> NDArray[np.int64]: ...
    def winding(
        self,
        points: NDArray[np.float32],
        out: Optional[NDArray[np.int32]] = None,
        *,
        cancel: Optional[Cancel] = None,
    ) -> NDArray[np.int32]: ...
    def contains(
        self,
        points: NDArray[np.float32],
        out: Optional[NDArray[np.bool_]] = None,
        *,
        rule: _FillRule = "nonzero",
        cancel: Optional[Cancel] = None,
    ) -> NDArray[np.bool_]: ...
    def closest_points(
        self,
        points: NDArray[np.float32],
        max_distance: Optional[float] = None,
        out: Optional[NDArray[np.void]] = None,
        *,
        cancel: Optional[Cancel] = None,
    ) -> NDArray[np.void]: ...
    def signed_distance(
        self,
        points: NDArray[np.float32],
        out: Optional[NDArray[np.float32]] = None,
        *,
        rule: _FillRule = "nonzero",
        max_distance: Optional[float] = None,
        cancel: Optional[Cancel] = None,
    ) -> NDArray[np.float32]: ...
    def render(
        self,
        size: Tuple[int, int] = (1024, 1024),
        *,
        eye: Optional[_Point] = None,
        target: Optional[_Point] = None,
        up: _Point = (0.0, 1.0, 0.0),
        fov: float = 45.0,
        light: Optional[_Point] = None,
        rays: Literal["primary", "shadow", "ao"] = "primary",
        ao_count: int = 16,
        ao_distance: float = 0.0,
        shading: Literal["plain", "lit", "normal", "depth", "prim", "steps", "sah"] = "plain",
        samples: int = 1,
        flat: bool = False,
        cancel: Optional[Cancel] = None,
    ) -> Image: ...
    def on(self, device: _DeviceLike) -> Scene: ...
    def tree_statistics(self) -> TreeStatistics: ...
    @property
    def device(self) -> Device: ...
    @property
    def bounds(self) -> Tuple[NDArray[np.float64], NDArray[np.float64]]: ...
    @property
    def triangle_count(self) -> int: ...
    @property
    def vertex_count(self) -> int: ...

class Image(_Made):
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def samples(self) -> int: ...
    @property
    def pixels(self) -> NDArray[np.uint8]: ...
    @property
    def hits(self) -> NDArray[np.void]: ...
    @property
    def occlusion(self) -> NDArray[np.uint32]: ...
    @property
    def ray_count(self) -> int: ...
    @property
    def trace_ms(self) -> float: ...
    @property
    def hits_hash(self) -> int: ...
    @property
    def image_hash(self) -> int: ...
    def save(self, path: _Path) -> None: ...

class Comparison(_Made):
    @property
    def compared(self) -> int: ...
    @property
    def different(self) -> int: ...
    @property
    def equal(self) -> bool: ...
    @property
    def differences(self) -> NDArray[np.void]: ...
    def __bool__(self) -> bool: ...

@overload
def compare(first: Scene, second: Scene, rays: _Rays, keep: int = 10) -> Comparison: ...
@overload
def compare(first: Image, second: Image, rays: None = None, keep: int = 10) -> Comparison: ...
