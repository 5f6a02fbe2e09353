"""Hits, insides, distances and images of deforming triangle meshes, with the same bits on every
machine, thread count, instruction set and Vulkan device.

    import numpy as np
    import morphray

    scene = morphray.Scene(points, triangles)   # (V, 3) float32, read in place; (T, 3) indices
    points[:, 2] += 0.1
    scene.update()
    hits = scene.intersect(rays)                # (N, 6): org and dir
    image = scene.render((640, 480))
    image.save("image.png")

morphray.open3d and morphray.trimesh have classes of these two libraries, for scripts that use them.
Arguments of a wrong type raise TypeError, arrays that do not fit ValueError, and all else Error with a
code. docs/guide/python.md is the guide.
"""

from typing import Any as _Any, NamedTuple as _NamedTuple

import numpy as _np
from numpy.typing import NDArray as _NDArray

from ._morphray import (
    DIGEST,
    INVALID_ID,
    Cancel,
    Comparison,
    Device,
    EdgeCounts,
    Error,
    Image,
    LeftOut,
    Scene,
    TreeStatistics,
    Update,
    VulkanDeviceInfo,
    __version__,
    closest_dtype,
    compare,
    hit_dtype,
    ray_dtype,
    simd_targets,
    vulkan_devices,
)
from . import _views as _views

__all__ = ["DIGEST", "INVALID_ID", "AllHits", "Cancel", "Comparison", "Crossings", "Device", "EdgeCounts",
           "Error", "Image", "LeftOut", "Mesh", "Scene", "Textures", "TreeStatistics", "Update",
           "VulkanDeviceInfo", "__version__", "closest_dtype", "compare", "hit_dtype", "ray_dtype",
           "simd_targets", "vulkan_devices"]


class Textures(_NamedTuple):
    """Images that the triangles of a mesh show.

    images:    (H, W, 3) or (H, W, 4) uint8, the top row first and encoded as in image files, or a
               list of such arrays
    texcoords: (T, 3, 2) float32: u and v of the corners of each triangle, from the lower left
    ids:       (T,) integers: the image of each triangle, or INVALID_ID for none; None: the first of all
    wrap:      beyond the image, "repeat" it or "clamp" to its border
    alpha_cutoff: from 0 to 1, or a list of one an image: where alpha / 255, linear between texels, is
               below it, rays of lit images pass. Queries and other images ignore it
    """

    images: _Any
    texcoords: _Any
    ids: _Any = None
    wrap: str = "repeat"
    alpha_cutoff: _Any = 0.0


class Mesh(_NamedTuple):
    """A mesh of a Scene of several. The fields are arguments of Scene.

    points:    (V, 3) float32, borrowed
    triangles: (T, 3) integers
    deforms:   whether Scene.update() reads the points again
    albedo:    (T, 3) uint8, (T,) uint32, or None
    textures:  Textures, or None
    """

    points: _Any
    triangles: _Any
    deforms: bool = True
    albedo: _Any = None
    textures: _Any = None


class AllHits(_NamedTuple):
    """The hits of Scene.intersect_all().

    offsets:  (N + 1,) int64: the hits of ray i are hits[offsets[i]:offsets[i + 1]]
    hits:     (H,) hit_dtype, by ray, and then in the order of (t, geom_id, prim_id)
    left_out: (N,) int64: for each ray, the hits beyond max_hits
    """

    offsets: _NDArray[_np.int64]
    hits: _NDArray[_np.void]
    left_out: _NDArray[_np.int64]

    def of_ray(self, ray: int) -> _NDArray[_np.void]:
        """The hits of a ray, a view of hits. Raises IndexError if there is no such ray."""
        if not 0 <= ray < len(self.left_out):
            raise IndexError(f"of_ray: there is no ray {ray} among {len(self.left_out)}")
        return self.hits[self.offsets[ray]:self.offsets[ray + 1]]

    @property
    def ray_ids(self) -> _NDArray[_np.int64]:
        """(H,) int64: the ray of each hit, made anew by each use."""
        return _np.repeat(_np.arange(len(self.left_out)), _np.diff(self.offsets))


class Crossings(_NamedTuple):
    """The pairs of triangles of Scene.crossings().

    pairs:    (P, 2, 2) uint32: geom_id and prim_id of two triangles, the lower ones first; in order
    left_out: the number of pairs beyond the limit
    """

    pairs: _NDArray[_np.uint32]
    left_out: int


def _repr(result: _Any) -> str:
    members = {name: getattr(result, name) for name, member in vars(type(result)).items()
               if isinstance(member, property)}
    shown = (f"{value} {name}" for name, value in members.items() if not isinstance(value, _np.ndarray))
    return f"<morphray.{type(result).__name__}: {', '.join(shown)}>"


for _value in (Comparison, EdgeCounts, Image, LeftOut, TreeStatistics, Update, VulkanDeviceInfo):
    setattr(_value, "__repr__", _repr)

# numpy.asarray(image) is the pixels.
setattr(Image, "__array__", lambda image, dtype=None, copy=None: image.pixels.astype(
    dtype or _np.uint8, copy=bool(copy)))

for _name, _value in list(globals().items()):
    if isinstance(_value, type) and not _name.startswith("_"):
        _value.__module__ = __name__
del _name, _value
