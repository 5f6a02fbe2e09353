"""Closest hits, any hits and images of deforming triangle meshes, with the same bits on every
machine, thread count, instruction set and Vulkan device.

    import numpy as np
    import morphray

    scene = morphray.Scene(points, triangles)   # (V, 3) float32, read in place; (T, 3) indices
    points[:, 2] += 0.1
    scene.update()
    hits = scene.cast_rays(rays)                # (N, 6) float32: org and dir
    image = scene.render((640, 480))
    image.save("image.png")

Arrays and arguments of a wrong type raise TypeError, arrays that do not fit ValueError, and all
else Error with a code. docs/guide/python.md is the guide.
"""

from typing import Any as _Any, NamedTuple as _NamedTuple

from ._morphray import (
    INVALID_ID,
    Cancel,
    Comparison,
    Device,
    Error,
    HitsWriter,
    Image,
    ImageHits,
    Scene,
    TreeStatistics,
    Update,
    VulkanDeviceInfo,
    __version__,
    compare,
    hit_dtype,
    ray_dtype,
    read_hits,
    simd_targets,
    vulkan_devices,
)


class Textures(_NamedTuple):
    """Images that the triangles of a mesh show.

    images:    (H, W, 3) or (H, W, 4) uint8, the top row first and encoded as in image files, or a
               list of such arrays; alpha is not read
    texcoords: (T, 3, 2) float32: u and v of the corners of each triangle, u from the left (0) to the
               right (1), v from the bottom (0) to the top (1)
    ids:       (T,) uint32, int32, uint64 or int64: the image of each triangle, or INVALID_ID for
               none; None: the first of all
    wrap:      beyond the image, "repeat" it or "clamp" to its border
    """

    images: _Any
    texcoords: _Any
    ids: _Any = None
    wrap: str = "repeat"


class Mesh(_NamedTuple):
    """A mesh of a Scene of several. The fields are arguments of Scene.

    points:    (V, 3) float32, borrowed
    triangles: (T, 3) uint32, int32, uint64 or int64
    deforms:   whether Scene.update() reads the points again
    albedo:    (T, 3) uint8, (T,) uint32, or None
    textures:  Textures, or None
    """

    points: _Any
    triangles: _Any
    deforms: bool = True
    albedo: _Any = None
    textures: _Any = None


__all__ = [
    "INVALID_ID",
    "Cancel",
    "Comparison",
    "Device",
    "Error",
    "HitsWriter",
    "Image",
    "ImageHits",
    "Mesh",
    "Scene",
    "Textures",
    "TreeStatistics",
    "Update",
    "VulkanDeviceInfo",
    "__version__",
    "compare",
    "hit_dtype",
    "ray_dtype",
    "read_hits",
    "simd_targets",
    "vulkan_devices",
]

for _name in __all__:
    if isinstance(globals()[_name], type):
        globals()[_name].__module__ = __name__
del _name
