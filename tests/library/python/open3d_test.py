"""morphray.open3d answers with the keys and dtypes of Open3D, which is not needed."""

import subprocess
import sys
import types

import numpy as np
import pytest

import morphray
import morphray.open3d
from scenes import assert_same_bits, cube, grid, random_rays, six, sphere

RAYS = np.array([[0.5, 0.25, -1, 0, 0, 1], [0.5, 0.25, 0.5, 0, 0, 1], [10, 10, 10, 1, 0, 0]],
                np.float32)
POINTS = np.array([[0.5, 0.5, 0.5], [-0.5, -0.5, -0.5], [0, 0, 0], [0.5, 0.75, 3]], np.float32)


class Tensor:
    """Has the methods of Open3D's tensors that are called, and no more."""

    @staticmethod
    def from_numpy(array):
        assert type(array) is np.ndarray
        return Tensor(array)

    def __init__(self, array):
        self._array = array

    def cpu(self):
        return self

    def numpy(self):
        return self._array


def cube_scene(**options):
    scene = morphray.open3d.RaycastingScene(**options)
    assert scene.add_triangles(*cube()) == 0
    return scene


def test_neither_open3d_nor_trimesh_is_imported():
    code = ("import sys; sys.modules['open3d'] = sys.modules['trimesh'] = None; "
            "import morphray, morphray.open3d, morphray.trimesh")
    subprocess.run([sys.executable, "-c", code], check=True)


def test_rays_have_the_keys_and_dtypes_of_open3d():
    scene = cube_scene()
    cast = scene.cast_rays(RAYS)
    assert cast["t_hit"].tolist() == [1, 0.5, np.inf]
    assert cast["geometry_ids"].tolist() == [0, 0, scene.INVALID_ID]
    assert scene.test_occlusions(RAYS).tolist() == [True, True, False]
    assert scene.test_occlusions(RAYS, tnear=0.75, tfar=1.5).tolist() == [True, False, False]
    counts = scene.count_intersections(RAYS)
    assert counts.tolist() == [2, 1, 0] and counts.dtype == np.int32
    lists = scene.list_intersections(RAYS)
    assert {key: array.dtype for key, array in lists.items()} == {
        "ray_splits": "u4", "ray_ids": "u4", "t_hit": "f4", "geometry_ids": "u4",
        "primitive_ids": "u4", "primitive_uvs": "f4"}
    assert lists["ray_splits"].tolist() == [0, 2, 3, 3] and lists["ray_ids"].tolist() == [0, 0, 1]
    assert lists["t_hit"].tolist() == [1, 2, 0.5] and lists["primitive_uvs"].shape == (3, 2)


def test_points_have_the_keys_and_dtypes_of_open3d():
    scene = cube_scene(device="brute")
    closest = scene.compute_closest_points(POINTS)
    assert {key: array.dtype for key, array in closest.items()} == {
        "points": "f4", "geometry_ids": "u4", "primitive_ids": "u4", "primitive_uvs": "f4",
        "primitive_normals": "f4"}
    assert closest["points"][1:].tolist() == [[0, 0, 0], [0, 0, 0], [0.5, 0.75, 1]]
    assert closest["primitive_normals"][3].tolist() == [0, 0, 1]
    assert (scene.compute_distance(POINTS) == np.float32([0.5, 0.75**0.5, 0, 2])).all()
    signed = scene.compute_signed_distance(POINTS, nsamples=3)
    assert (signed == np.float32([-0.5, 0.75**0.5, 0, 2])).all()
    inside = scene.compute_occupancy(POINTS)
    assert inside.tolist() == [1, 0, 1, 0] and inside.dtype == np.float32


def test_insides_are_odd_crossings_as_in_open3d():
    points, triangles = cube()
    triangles[0] = triangles[0, ::-1]
    where = np.array([[0.25, 0.75, 0.75], [-0.25, 0.25, 0.75], [0.75, 0.75, 0.75]], np.float32)
    for rule, inside in [("odd", [1, 0, 0]), ("nonzero", [1, 0, 1])]:
        scene = morphray.open3d.RaycastingScene(rule=rule)
        scene.add_triangles(points, triangles if rule == "odd" else cube()[1])
        scene.add_triangles(points + np.float32(0.5), cube()[1])
        assert scene.compute_occupancy(where).tolist() == inside
        assert (scene.compute_signed_distance(where) <= 0).tolist() == [i == 1 for i in inside]


def test_answers_are_those_of_the_scene():
    points, triangles = grid(10)
    rays = six(random_rays(points, 600)).reshape(20, 30, 6)
    own = morphray.open3d.RaycastingScene()
    own.add_triangles(points, triangles)
    own.add_triangles(*sphere())
    scene = morphray.Scene([(points, triangles), sphere()])
    hits, cast = scene.intersect(rays), own.cast_rays(rays)
    is_hit = hits["prim_id"] != morphray.INVALID_ID
    assert list(cast) == [
        "t_hit", "geometry_ids", "primitive_ids", "primitive_uvs", "primitive_normals",
    ]
    assert [a.dtype for a in cast.values()] == ["f4", "u4", "u4", "f4", "f4"]
    assert np.array_equal(cast["t_hit"], np.where(is_hit, hits["t"], np.inf).astype(np.float32))
    assert np.array_equal(cast["primitive_ids"], hits["prim_id"])
    assert np.array_equal(cast["geometry_ids"], hits["geom_id"])
    assert np.array_equal(cast["primitive_uvs"], np.stack([hits["u"], hits["v"]], axis=-1))
    assert not cast["primitive_normals"][~is_hit].any()
    assert np.array_equal(own.count_intersections(rays, nthreads=2), scene.count(rays))
    assert type(cast["t_hit"].numpy()) is np.ndarray
    own_ids = np.stack([cast["geometry_ids"], cast["primitive_ids"]], axis=-1)
    behind = own.cast_rays(rays, excluded=own_ids)
    assert (behind["t_hit"][is_hit] >= cast["t_hit"][is_hit]).all()
    assert np.array_equal(own.test_occlusions(rays, excluded=own_ids), behind["t_hit"] < np.inf)
    where = rays[..., :3]
    closest = own.compute_closest_points(where)
    assert closest["points"].shape == closest["primitive_normals"].shape == (20, 30, 3)
    assert set(closest["geometry_ids"].ravel()) == {0, 1}
    meshes = [(points, triangles), sphere()]
    for found in closest, {key: array[is_hit] for key, array in cast.items()}:
        for geom_id, prim_id, normal in zip(found["geometry_ids"].ravel(),
                                            found["primitive_ids"].ravel(),
                                            found["primitive_normals"].reshape(-1, 3)):
            p0, p1, p2 = meshes[geom_id][0][meshes[geom_id][1][prim_id]].astype(np.float64)
            n = np.cross(p1 - p0, p2 - p0)
            assert np.abs(normal - n / np.linalg.norm(n)).max() < 1e-6
    assert_same_bits(own.compute_distance(where), scene.closest_points(where)["distance"].copy())


def test_meshes_are_copied_and_may_be_tensors():
    points, triangles = cube()
    scene = morphray.open3d.RaycastingScene(nthreads=1, device="CPU:0")
    mesh = types.SimpleNamespace(
        vertex=types.SimpleNamespace(positions=Tensor(points)),
        triangle=types.SimpleNamespace(indices=Tensor(triangles.astype(np.int64))))
    assert scene.add_triangles(mesh) == 0
    points += np.float32(5)
    assert scene.count_intersections(Tensor(RAYS)).numpy().tolist() == [2, 1, 0]
    assert scene.add_triangles(Tensor(points), Tensor(triangles)) == 1
    assert scene.compute_occupancy(Tensor(POINTS + np.float32(5))).numpy().tolist() == [1, 0, 1, 0]
    assert scene.compute_closest_points(POINTS + np.float32(5))["geometry_ids"][0] == 1


def test_results_are_tensors_where_tensors_were_given():
    scene = cube_scene()
    for ask, given in [
        (scene.cast_rays, RAYS), (scene.test_occlusions, RAYS), (scene.list_intersections, RAYS),
        (scene.count_intersections, RAYS), (scene.compute_closest_points, POINTS),
        (scene.compute_distance, POINTS), (scene.compute_signed_distance, POINTS),
        (scene.compute_occupancy, POINTS),
    ]:
        arrays, tensors = ask(given), ask(Tensor(given))
        if not isinstance(arrays, dict):
            arrays, tensors = {"": arrays}, {"": tensors}
        for name, array in arrays.items():
            assert type(tensors[name]) is Tensor
            assert_same_bits(tensors[name].numpy(), array.numpy())
    assert scene.cast_rays(RAYS)["t_hit"].isfinite().tolist() == [True, True, False]
    view = [Tensor(np.eye(3)), np.eye(4), 2, 2]
    assert type(scene.create_rays_pinhole(*view)) is Tensor


def test_an_empty_scene_has_answers():
    scene = morphray.open3d.RaycastingScene()
    assert scene.count_intersections(RAYS).tolist() == [0, 0, 0]
    assert scene.list_intersections(RAYS)["ray_splits"].tolist() == [0, 0, 0, 0]
    assert (scene.compute_distance(POINTS) == np.inf).all()
    assert not scene.compute_occupancy(POINTS).any()
    closest = scene.compute_closest_points(POINTS)
    assert (closest["primitive_ids"] == scene.INVALID_ID).all()
    assert not closest["primitive_normals"].any()


def test_rays_of_a_pinhole_camera_pass_through_the_middles_of_pixels():
    rays = morphray.open3d.RaycastingScene.create_rays_pinhole(
        fov_deg=90, center=[0, 0, 0], eye=[0, 0, -4], up=[0, 1, 0], width_px=4, height_px=2)
    assert rays.shape == (2, 4, 6) and rays.dtype == np.float32
    assert (rays[..., :3] == [0, 0, -4]).all() and np.allclose(rays[..., 5], 1)
    assert np.allclose(rays[0, :, 3], [-0.75, -0.25, 0.25, 0.75])
    assert np.allclose(rays[:, 0, 4], [-0.25, 0.25])
    intrinsic = [[2, 0, 2], [0, 2, 1], [0, 0, 1]]
    extrinsic = np.eye(4)
    extrinsic[2, 3] = 4
    twins = morphray.open3d.RaycastingScene.create_rays_pinhole(intrinsic, extrinsic, 4, 2)
    assert np.allclose(twins, rays)


@pytest.mark.parametrize("along, instead", [([0, 0, -2], [0, 1, 0]), ([0, 3, 0], [0, 0, 1]),
                                            ([1, 2, 2.5], [0, 1, 0]), ([4, -1, 1], [0, 0, 1])])
def test_a_view_along_up_has_another_up(along, instead):
    """z, or y for a view that is mainly along z."""
    make = morphray.open3d.RaycastingScene.create_rays_pinhole
    eye = np.array([0.5, 0.25, 1])
    expected = make(60, eye + along, eye, instead, 8, 6)
    assert np.isfinite(expected).all()
    for length in (1, -3, 1e-3):
        rays = make(60, eye + along, eye, np.multiply(length, along), 8, 6)
        assert np.allclose(rays, expected, atol=1e-6)


@pytest.mark.parametrize("ask, error, reason", [
    (lambda s: s.cast_rays(RAYS.astype(complex)), TypeError, "rays: dtype float32"),
    (lambda s: s.count_intersections(RAYS[0, :5]), ValueError, "rays: a shape of"),
    (lambda s: s.compute_distance(RAYS), ValueError, "points: a shape of"),
    (lambda s: s.add_triangles(POINTS), TypeError, "not ndarray"),
    (lambda s: s.add_triangles(POINTS.astype(int), cube()[1]), TypeError, "float32"),
    (lambda s: s.add_triangles(POINTS, cube()[1]), morphray.Error, "has vertex"),
    (lambda s: morphray.open3d.RaycastingScene(device="SYCL:0"), ValueError, "SYCL:0"),
    (lambda s: s.create_rays_pinhole(np.eye(3), np.eye(3), 4, 4), ValueError,
     r"extrinsic_matrix: a shape of \(4, 4\)"),
    (lambda s: s.create_rays_pinhole(np.diag([1, 0, 1]), np.eye(4), 4, 4), np.linalg.LinAlgError,
     "Singular matrix"),
    (lambda s: s.create_rays_pinhole(60, [1, 2, 3], [1, 2, 3], [0, 1, 0], 4, 4), ValueError,
     "eye and center are both"),
    (lambda s: s.create_rays_pinhole(60, [1, 2, 3], [0, 0, 0], [0, 0, 0], 4, 4), ValueError,
     "up: .* has no direction"),
    (lambda s: s.create_rays_pinhole(180, [1, 2, 3], [0, 0, 0], [0, 1, 0], 4, 4), ValueError,
     "fov_deg: 180 is not"),
    (lambda s: s.create_rays_pinhole(60, [np.nan, 2, 3], [0, 0, 0], [0, 1, 0], 4, 4), ValueError,
     "not finite"),
    (lambda s: s.create_rays_pinhole(60, [0, 0, 0], [1e39, 0, 0], [0, 1, 0], 4, 4), ValueError,
     "too large for float32"),
])
def test_bad_arguments(ask, error, reason):
    scene = cube_scene()
    with pytest.raises(error, match=reason):
        ask(scene)
    assert scene.count_intersections(RAYS).tolist() == [2, 1, 0]
