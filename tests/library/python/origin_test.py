"""Coordinates far from 0, such as those of UTM, keep the digits that float32 has no room for."""

import warnings

import numpy as np
import pytest

import morphray
from scenes import assert_same_bits, cube

CORNER = np.array([528980.85, 183526.1, 10.0])
DIRS = np.array([[1.0, 0, 0], [0, 1, 0]])


def box():
    """A box of 5 units in UTM."""
    points, triangles = cube()
    return points * 5.0 + CORNER, triangles


def rays_to(middle, dtype=np.float64):
    return np.concatenate([middle - 10 * DIRS, DIRS], axis=1).astype(dtype)


def test_points_and_answers_have_the_coordinates_of_the_caller():
    points, triangles = box()
    scene = morphray.Scene(points, triangles)
    assert (np.abs(scene.origin - CORNER) < 10).all()
    assert np.abs(scene.bounds - np.array([CORNER, CORNER + 5])).max() < 1e-6
    near = CORNER + [[0.001, 2, 2.5], [-0.001, 2, 2.5]]
    assert scene.contains(near).tolist() == [True, False]
    assert np.abs(scene.signed_distance(near) - [-0.001, 0.001]).max() < 1e-6
    closest = scene.closest_points(near)
    assert np.abs(closest["point"] - (CORNER + [0, 2, 2.5])).max() < 1e-6
    assert scene.normals(closest).shape == (2, 3)
    one = scene.closest_points(near[0])
    assert one.shape == () and (one["point"] == closest["point"][0]).all()
    again = np.empty(2, closest.dtype)
    assert scene.closest_points(near, out=again) is again and (again == closest).all()
    with pytest.raises(TypeError, match="out: dtype"):
        scene.closest_points(near, out=np.empty(2, morphray.closest_dtype))
    missed = scene.closest_points(near + 100, max_distance=1)
    assert not missed["point"].any() and np.isinf(missed["distance"]).all()


def test_rays_start_where_the_caller_says():
    points, triangles = box()
    scene = morphray.Scene(points, triangles)
    rays = rays_to(CORNER + [2, 2, 2.5])
    expected = [8, 8]
    assert np.abs(scene.intersect(rays)["t"] - expected).max() < 1e-5
    assert np.abs(scene.intersect(rays.tolist())["t"] - expected).max() < 1e-5
    # float32 moves them along by up to its step there.
    assert np.abs(scene.intersect(rays.astype(np.float32))["t"] - expected).max() < 0.04
    eight = np.insert(rays, 3, 0, axis=1)
    eight = np.append(eight, np.full((2, 1), np.inf), axis=1)
    assert_same_bits(scene.intersect(eight), scene.intersect(rays))
    structured = eight.astype(np.float32).view(morphray.ray_dtype)[:, 0]
    assert_same_bits(scene.intersect(structured), scene.intersect(rays.astype(np.float32)))
    assert scene.intersect_all(rays).hits["t"].shape == (4,)
    assert morphray.compare(scene, scene.on("brute"), rays).different == 0
    bounded = morphray.Scene(points, triangles, bounds=(CORNER - 5, CORNER + 10))
    assert np.abs(bounded.intersect(rays)["t"] - expected).max() < 1e-5


def test_the_origin_is_0_where_floats_have_the_digits():
    points, triangles = cube()
    for mesh in (points, points * 5.0, points + np.float32(1 << 20), points + 2.0**20):
        assert morphray.Scene(mesh, triangles).origin.tolist() == [0, 0, 0]
    assert morphray.Scene([]).origin.tolist() == [0, 0, 0]
    assert morphray.Scene(points * 0.3, triangles, origin=(1, 2, 3)).origin.tolist() == [1, 2, 3]
    with pytest.raises(morphray.Error, match="origin"):
        morphray.Scene(points, triangles, origin=(np.nan, 0, 0))


def test_all_meshes_and_poses_have_one_origin():
    points, triangles = box()
    scene = morphray.Scene(points, triangles)
    origin = scene.origin
    rounded = (points + [20, 0, 0]).astype(np.float32)
    scene.attach(rounded, triangles)
    points += 0.25
    scene.update()
    assert (scene.origin == origin).all()
    assert np.abs(scene.intersect(rays_to(CORNER + [2, 2, 2.5]))["t"] - 8.25).max() < 1e-5
    upper = np.maximum(points.max(axis=0), rounded.astype(np.float64).max(axis=0))
    assert np.abs(scene.bounds[1] - upper).max() < 1e-5
    scene.update(0, points - 0.25)
    assert np.abs(scene.intersect(rays_to(CORNER + [2, 2, 2.5]))["t"] - 8).max() < 1e-5


def test_one_warning_tells_of_points_that_are_moved_all_the_same():
    points, triangles = box()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = morphray.Scene(points, triangles)
        scene.attach(points + 10, triangles)
        scene.update()
    with pytest.warns(UserWarning, match="mesh 2: .* more than 1e-6") as told:
        scene.attach(points * 11, triangles)
        scene.update()
        scene.attach(points * 11, triangles)
        scene.update()
    assert len(told) == 1
    with pytest.warns(UserWarning, match="more than 1e-6"):
        morphray.Scene(points, triangles, origin=(0, 0, 0))


def test_an_empty_scene_finds_its_origin_at_the_first_mesh():
    points, triangles = box()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = morphray.Scene([])
        assert scene.attach(points + 99, triangles) == 0
        assert scene.attach(points, triangles) == 1
        scene.detach(0)
        scene.update()
        assert scene.attach(points + 10, triangles) == 0
        scene.update()
    assert np.abs(scene.origin - CORNER - 99).max() < 10
    hits = scene.intersect(rays_to(CORNER + [2, 2, 2.5]))
    assert np.abs(hits["t"] - 8).max() < 1e-5 and (hits["geom_id"] == 1).all()


@pytest.mark.parametrize("move", [
    lambda scene, points: scene.update(),
    lambda scene, points: scene.update(0, points.copy()),
    lambda scene, points: scene.update_with_new_bounds(),
])
def test_a_mesh_that_moves_far_away_is_told_of(move):
    points, triangles = cube()
    points = points.astype(np.float64)
    scene = morphray.Scene(points, triangles)
    points += CORNER
    with pytest.warns(UserWarning, match="more than 1e-6"):
        move(scene, points)


def test_points_that_are_left_out_are_told_of_once_a_mesh():
    points, triangles = cube()
    points = points.astype(np.float32)
    rest = points.copy()
    scene = morphray.Scene([(points, triangles), (rest + np.float32(3), triangles)])
    before = scene.intersect([[0.2, 0.3, 9, 0, 0, -1]])
    points[0] = 1e20
    points[1] = np.nan
    with pytest.warns(UserWarning, match="mesh 0: 1 are not finite and 1 too far") as told:
        update = scene.update()
        scene.update()
    assert len(told) == 1
    (mesh,) = update.left_out
    assert (mesh.geom_id, mesh.not_finite, mesh.too_far) == (0, 1, 1)
    points[:] = rest
    assert scene.update().left_out == []
    assert_same_bits(scene.intersect([[0.2, 0.3, 9, 0, 0, -1]]), before)
