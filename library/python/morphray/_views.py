"""Scene.render_views(): cameras of many views to arrays of their pixels."""

import operator

import numpy as np

from ._morphray import Scene

# The dtype of each channel, and its numbers a pixel.
_CHANNELS = {
    "depth": (np.float32, ()),
    "distance": (np.float32, ()),
    "geom_id": (np.uint32, ()),
    "prim_id": (np.uint32, ()),
    "normal": (np.float32, (3,)),
    "uv": (np.float32, (2,)),
    "shaded": (np.uint8, (4,)),
}


def _rows(name, given, shape, count=None):
    """Numbers of (count, *shape) as rows of float64; given a count, those of `shape` are for all."""
    numbers = np.asarray(given, np.float64)
    if count is None:
        count = len(numbers) if numbers.ndim > 0 else 0
    elif numbers.shape == shape:
        numbers = np.broadcast_to(numbers, (count, *shape))
    if numbers.shape != (count, *shape):
        raise ValueError(f"{name}: a shape of {(count, *shape)} is needed, not {numbers.shape}")
    return numbers.reshape(count, np.prod(shape))


def _pinholes(camera_to_world, intrinsics, convention):
    """Rows of camera_to_world, with OpenCV's axes, and intrinsics."""
    matrices = np.asarray(camera_to_world, np.float64)
    if matrices.shape[1:] == (4, 4):
        if (matrices[:, 3] != (0, 0, 0, 1)).any():
            raise ValueError("camera_to_world: the last row of each matrix must be (0, 0, 0, 1)")
        matrices = matrices[:, :3]
    if convention not in ("opencv", "opengl"):
        raise ValueError(f'convention: "{convention}" is none of "opencv", "opengl"')
    rows = _rows("camera_to_world", matrices, (3, 4))
    if convention == "opengl":
        rows = rows * np.tile([1.0, -1, -1, 1], 3)
    return np.hstack([rows, _rows("intrinsics", intrinsics, (4,), len(rows))])


def _array(name, shape, out):
    """The array of a channel for pixels of this shape."""
    if name not in _CHANNELS:
        raise ValueError(f'channels: "{name}" is none of {", ".join(_CHANNELS)}')
    dtype, numbers = _CHANNELS[name]
    array = out[name] if name in out else np.empty(shape + numbers, dtype)
    fits = (isinstance(array, np.ndarray) and array.dtype == dtype and array.shape == shape + numbers
            and array.flags.c_contiguous and array.flags.writeable and array.ctypes.data % 4 == 0)
    if not fits:
        raise ValueError(f"out: {name}: a writeable C-contiguous array of {dtype.__name__} is needed, of "
                         f"the shape {shape + numbers} and aligned to 4 bytes")
    return array


def render_views(self, eyes=None, targets=None, *, camera_to_world=None, intrinsics=None,
                 convention="opencv", up=(0, 1, 0), fov=45.0, size=(64, 64), channels=("depth",),
                 out=None, cancel=None):
    """Renders N views of one size together. Returns a dict of arrays by channel.

    Cameras are given by eyes and targets, or by camera_to_world and intrinsics:
    eyes, targets: (N, 3) numbers in the units of the points; one target (3,) is that of all views
    up:           (N, 3) or (3,) numbers, for eyes and targets; fov is vertical, in degrees
    camera_to_world: (N, 3, 4) or (N, 4, 4) matrices of a rotation and a translation. The columns are the
                  axes of the camera and its place. A world-to-camera matrix (R, t) has the inverse
                  (R.T, -R.T @ t)
    intrinsics:   (fx, fy, cx, cy) in pixels, (N, 4) or (4,)
    convention:   of the camera's axes: "opencv", x right, y down, z forward, or "opengl", x right, y up,
                  z backward. Either way pixels are counted from the upper left corner, and the centre of
                  the first is (0.5, 0.5): add 0.5 to a principal point of OpenCV, which counts from there
    size:         (width, height) in pixels
    channels:     one or more of these; only their arrays are made, (N, height, width) row by row from the
                  top. In brackets is the value without a hit.
        "depth"     float32, along the viewing direction (inf)
        "distance"  float32, along the ray (inf)
        "geom_id", "prim_id": uint32 (INVALID_ID)
        "normal"    (N, height, width, 3) float32, as of normals(), not smooth (0)
        "uv"        (N, height, width, 2) float32, as of intersect() (0)
        "shaded"    (N, height, width, 4) uint8, as Image.pixels, shading "plain"
    out:          a dict of C-contiguous arrays by channel, which are written to; others are made
    cancel:       a morphray.Cancel, which ends the call with Error "cancelled"

    intersect() has the same bits for the rays of docs/guide/sensors.md. Raises TypeError or ValueError for
    arguments that do not fit, and Error "bad_input" for an impossible camera, "limit".
    """
    given = [argument is not None for argument in (eyes, targets, camera_to_world, intrinsics)]
    if given not in ([True, True, False, False], [False, False, True, True]):
        raise TypeError("render_views: eyes and targets are needed, or camera_to_world and intrinsics")
    if eyes is None:
        cameras = _pinholes(camera_to_world, intrinsics, convention)
    else:
        places = _rows("eyes", eyes, (3,))
        cameras = np.hstack([places] + [_rows(name, points, (3,), len(places))
                                        for name, points in [("targets", targets), ("up", up)]])
    try:
        width, height = map(operator.index, size)
    except (TypeError, ValueError):
        raise TypeError("size: two whole numbers (width, height) are needed, not "
                        f"{size!r}") from None
    if width < 1 or height < 1:
        raise ValueError(f"size: {size} has no pixels; give a width and a height of 1 or more")
    out = out or {}
    names = [channels] if isinstance(channels, str) else channels
    arrays = {name: _array(name, (len(cameras), height, width), out) for name in names}
    if not out.keys() <= arrays.keys():
        raise ValueError(f"out: {sorted(out.keys() - arrays.keys())} are not among the channels")
    self._render_views(cameras, fov, (width, height), arrays, cancel)
    return arrays


Scene.render_views = render_views
