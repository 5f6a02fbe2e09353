"""Many views in one call: Scene.render_views()."""

import pathlib
import re

import numpy as np
import pytest

import morphray
from scenes import grid, sphere, triangle

GUIDE = pathlib.Path(__file__).resolve().parents[3] / "docs/guide/sensors.md"
CHANNELS = ("depth", "distance", "geom_id", "prim_id", "normal", "uv", "shaded")
LENS = (30, 33, 14.25, 10.5)

exec(re.search(r"^def rays_of.*?(?=^\S+ =)", GUIDE.read_text(), re.S | re.M)[0])


def scene_and_matrices(count=5, **options):
    random = np.random.default_rng(3)
    scene = morphray.Scene([grid(12), sphere(8, 0.2, (0.5, 0.5, 0.6))], **options)
    matrices = np.empty((count, 3, 4))
    for matrix in matrices:
        q, _ = np.linalg.qr(np.diag([1, -1, -1]) + 0.2 * random.normal(size=(3, 3)))
        matrix[:, :3] = q * np.sign(np.diag(q) * (1, -1, -1))
    matrices[:, :, 3] = random.uniform((0, 0, 1.5), (1, 1, 2.5), (count, 3))
    return scene, matrices


@pytest.mark.parametrize("place, size, dtype", [
    ((0, 0, 0), 1, np.float32), ((4e5, 5e6, 10), 1, np.float64), ((5.0001, -9, 2), 1e-3, np.float32)])
def test_rays_are_those_of_the_guide(place, size, dtype):
    scene, matrices = scene_and_matrices()
    if any(place):
        points, triangles = grid(12)
        scene = morphray.Scene((size * points + place).astype(dtype), triangles)
        matrices[:, :, 3] = size * matrices[:, :, 3] + place
        assert scene.origin.any() == (dtype == np.float64)
    images = scene.render_views(camera_to_world=matrices, intrinsics=LENS, size=(28, 21),
                                channels=CHANNELS)
    assert tuple(images) == CHANNELS
    rays = np.array([rays_of(matrix, *LENS, 28, 21) for matrix in matrices])
    hits = scene.intersect(rays)
    assert np.isfinite(hits["t"]).any()
    dir = rays[..., 3:]
    for channel, expected in [
        ("depth", hits["t"]),
        ("distance", (hits["t"] * np.sqrt((dir[..., 0] ** 2 + dir[..., 1] ** 2) + dir[..., 2] ** 2))
         .astype(np.float32)),
        ("geom_id", hits["geom_id"]),
        ("prim_id", hits["prim_id"]),
        ("normal", scene.normals(hits)),
        ("uv", np.stack([hits["u"], hits["v"]], axis=-1)),
    ]:
        assert images[channel].dtype == expected.dtype
        np.testing.assert_array_equal(images[channel], expected, channel)
    assert images["shaded"].shape == (5, 21, 28, 4) and (images["shaded"][..., 3] == 255).all()


def test_axes_and_matrices_of_opengl():
    scene, matrices = scene_and_matrices()
    expected = scene.render_views(camera_to_world=matrices, intrinsics=LENS)["depth"]
    square = np.concatenate([matrices, np.tile([[[0.0, 0, 0, 1]]], (5, 1, 1))], axis=1)
    square[:, :, 1:3] *= -1
    depth = scene.render_views(camera_to_world=square, intrinsics=np.tile(LENS, (5, 1)),
                               convention="opengl")["depth"]
    np.testing.assert_array_equal(depth, expected)


def test_eyes_and_targets_are_those_of_render():
    scene, matrices = scene_and_matrices()
    eyes = matrices[:, :, 3]
    images = scene.render_views(eyes, (0.5, 0.5, 0), up=(1, 1, 0), fov=30, size=(9, 7),
                                channels=["depth", "shaded"])
    for i, eye in enumerate(eyes):
        image = scene.render((9, 7), eye=eye, target=(0.5, 0.5, 0), up=(1, 1, 0), fov=30)
        np.testing.assert_array_equal(images["depth"][i], image.hits["t"])
        np.testing.assert_array_equal(images["shaded"][i], image.pixels)


def test_out_is_written_in_place():
    scene, matrices = scene_and_matrices()
    cameras = {"camera_to_world": matrices, "intrinsics": LENS, "size": (8, 6)}
    expected = scene.render_views(**cameras, channels=CHANNELS)
    out = {name: np.zeros_like(array) for name, array in expected.items()}
    images = scene.render_views(**cameras, channels=CHANNELS, out=out)
    for name in CHANNELS:
        assert images[name] is out[name]
        np.testing.assert_array_equal(images[name], expected[name])
    some = scene.render_views(**cameras, channels="depth", out={"depth": out["depth"]})
    assert list(some) == ["depth"] and some["depth"] is out["depth"]


def test_no_view_makes_empty_arrays():
    scene = morphray.Scene(*triangle())
    images = scene.render_views(np.empty((0, 3)), (0, 0, 0), size=(4, 3), channels=CHANNELS)
    assert images["normal"].shape == (0, 3, 4, 3) and images["depth"].shape == (0, 3, 4)


EYES = np.array([[0.2, 0.2, 2.0]])
MATRIX = np.diag([1.0, -1, -1, 1])[None]
FIXED = {"camera_to_world": MATRIX, "intrinsics": LENS}


@pytest.mark.parametrize("arguments, error, reason", [
    ({}, TypeError, "eyes and targets are needed, or"),
    ({"eyes": EYES}, TypeError, "eyes and targets are needed, or"),
    ({**FIXED, "eyes": EYES, "targets": EYES}, TypeError, "eyes and targets are needed, or"),
    ({"eyes": EYES[0], "targets": EYES}, ValueError, r"eyes: a shape of \(3, 3\) is needed, not \(3,\)"),
    ({"eyes": EYES, "targets": np.zeros((2, 3))}, ValueError, r"targets: a shape of \(1, 3\)"),
    ({**FIXED, "intrinsics": (1, 2, 3)}, ValueError, "intrinsics: a shape of"),
    ({**FIXED, "camera_to_world": MATRIX[0]}, ValueError, "camera_to_world: a shape of"),
    ({**FIXED, "camera_to_world": 2 * MATRIX}, ValueError, "the last row of each matrix"),
    ({**FIXED, "camera_to_world": 2 * MATRIX[:, :3]}, morphray.Error, "not those of a rotation"),
    ({**FIXED, "convention": "ros"}, ValueError, '"ros" is none of'),
    ({**FIXED, "channels": ["depth", "colour"]}, ValueError, '"colour" is none of depth, distance'),
    ({**FIXED, "size": (0, 4)}, ValueError, r"size: \(0, 4\) has no pixels"),
    ({**FIXED, "size": (5,)}, TypeError, r"size: two whole numbers .* not \(5,\)"),
    ({**FIXED, "size": 5}, TypeError, "size: two whole numbers .* not 5"),
    ({**FIXED, "out": {"uv": np.empty(1)}}, ValueError, r"\['uv'\] are not among the channels"),
    ({**FIXED, "out": {"depth": np.empty((1, 64, 64))}}, ValueError, "out: depth: .* of float32"),
    ({**FIXED, "out": {"depth": np.empty((1, 64, 63), np.float32)}}, ValueError, "of the shape"),
    ({**FIXED, "out": {"depth": np.empty((1, 64, 128), np.float32)[..., ::2]}}, ValueError,
     "C-contiguous"),
])
def test_refusals(arguments, error, reason):
    with pytest.raises(error, match=reason):
        morphray.Scene(*triangle()).render_views(**arguments)


def test_cancel():
    cancel = morphray.Cancel()
    cancel.set()
    with pytest.raises(morphray.Error) as caught:
        morphray.Scene(*triangle()).render_views(**FIXED, cancel=cancel)
    assert caught.value.code == "cancelled"
