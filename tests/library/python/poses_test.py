"""Meshes that follow matrices."""

import numpy as np
import pytest

import morphray
from scenes import assert_same_bits, grid, random_rays, sphere

BOUNDS = ((-4, -4, -4), (4, 4, 4))


def turned(angle, shift):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, shift], [0.8 * s, 0.8 * c, -0.6, 0], [0.6, 0, 0.8, 0.1]])


def moved(pose, rest):
    matrix, shift = pose[:, :3].astype(np.float32), pose[:, 3].astype(np.float32)
    x, y, z = rest.T
    return np.stack([((m[0] * x + m[1] * y) + m[2] * z) + t for m, t in zip(matrix, shift)], axis=1)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_poses_are_those_of_numpys_lines(dtype):
    body, triangles = sphere(12)
    cloth = grid(16)
    scene = morphray.Scene([(body, triangles), cloth, (body, triangles)], bounds=BOUNDS)
    poses = np.stack([turned(1, 2), turned(-1, -0.5)]).astype(dtype)
    update = scene.update(poses=poses, geom_ids=[2, 0])
    assert update.step != "keep" and update.left_out == []
    bodies = [moved(pose, body) for pose in poses]
    twin = morphray.Scene([(bodies[1], triangles), cloth, (bodies[0], triangles)], bounds=BOUNDS)
    rays = random_rays(np.concatenate([*bodies, cloth[0]]), 1000)
    assert_same_bits(scene.intersect(rays), twin.intersect(rays))
    # A slice of larger matrices, and integers of numpy. The tree may be rebuilt where nothing moves.
    wide = np.zeros((2, 4, 4), dtype)
    wide[:, :3] = poses
    assert scene.update(poses=wide[:, :3], geom_ids=np.array([2, 0])).step in ("keep", "restructure", "rebuild")
    body *= np.float32(0.5)
    assert scene.update().step in ("keep", "restructure", "rebuild")
    assert scene.update(0).step != "keep"


def test_what_is_no_pose_is_refused():
    points, triangles = sphere(8)
    scene = morphray.Scene(points, triangles, bounds=BOUNDS)
    pose = turned(1, 1)
    for poses, geom_ids, error, words in [
            (pose, [0], ValueError, "poses: a shape of (n, 3, 4) is needed"),
            (np.eye(4)[None], [0], ValueError, "(n, 3, 4)"),
            (pose[None], [0, 1], ValueError, "geom_ids: 2 for 1 poses"),
            (pose[None], [-1], TypeError, "geom_ids: whole numbers"),
            (pose[None], 0, TypeError, "geom_ids: whole numbers"),
            (pose[None].astype(np.int64), [0], TypeError, "float32 or float64"),
            ("pose", [0], TypeError, "poses: a numpy.ndarray"),
            (pose[None], [1], morphray.Error, "geom_id 1"),
            (np.stack([pose, pose]), [0, 0], morphray.Error, "geom_id 0 has several poses"),
            (pose[None] * np.nan, [0], morphray.Error, "mesh 0 has a number that is not finite"),
            (pose[None] * 1e39, [0], morphray.Error, "beyond floats")]:
        with pytest.raises(error) as caught:
            scene.update(poses=poses, geom_ids=geom_ids)
        assert words in str(caught.value)
    assert scene.update().step == "keep"
