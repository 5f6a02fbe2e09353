"""Queries answer as brute force does, bit by bit."""

import numpy as np
import pytest

import morphray
from scenes import DOWN, assert_same_bits, brute_force, grid, random_rays, six, triangle

RAYS = 3000


def test_bounds_fix_the_bits():
    points, triangles = grid(10)
    bounds = ((-1, -1, -1), [2, 2, 2])
    rays = random_rays(points, RAYS)
    moving = morphray.Scene(points, triangles, bounds=bounds, update="refit")
    for step in range(3):
        points[:, 2] += np.float32(0.1) * points[:, 0] * step
        moving.update()
        assert_same_bits(
            moving.intersect(rays),
            brute_force(points, triangles, rays, bounds=np.array(bounds, np.float64)),
        )


def test_six_numbers_and_fields_are_the_same_rays_as_eight():
    points, triangles = grid(10)
    scene = morphray.Scene(points, triangles)
    rays = random_rays(points, RAYS)
    rays[:, 3] = 0
    rays[:, 7] = np.inf
    expected = scene.intersect(rays)
    assert_same_bits(scene.intersect(six(rays)), expected)
    fields = np.empty(RAYS, morphray.ray_dtype)
    fields["org"], fields["tnear"] = rays[:, 0:3], rays[:, 3]
    fields["dir"], fields["tfar"] = rays[:, 4:7], rays[:, 7]
    assert_same_bits(scene.intersect(fields), expected)


def test_more_rays_than_a_batch_has():
    points, triangles = grid(3)
    scene = morphray.Scene(points, triangles)
    rays = random_rays(points, 300_000)
    rays[:, 3], rays[:, 7] = 0, np.inf
    expected = scene.intersect(rays)
    assert_same_bits(scene.intersect(six(rays)), expected)
    cast = scene.cast_rays(rays)
    assert_same_bits(cast["primitive_ids"], np.ascontiguousarray(expected["prim_id"]))
    comparison = morphray.compare(scene, morphray.Scene(*grid(3, seed=5)), six(rays))
    assert comparison.compared == 300_000
    assert len(comparison.differences) == 10


@pytest.mark.parametrize("coherence", ["none", "sort", 0, 1, 700, 2**32 - 1])
def test_answers_are_the_same_whatever_is_said_of_the_rays(coherence):
    points, triangles = grid(20)
    scene = morphray.Scene(points, triangles)
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 700), np.linspace(-0.5, 0.5, 400))
    image = np.empty((400, 700, 6), np.float32)
    image[..., :3] = 0.4, 0.3, 2
    image[..., 3:] = np.stack([x, y, -2 + 0 * x], axis=-1)
    for rays in (random_rays(points, 20_000), image):
        hits = scene.intersect(rays)
        assert_same_bits(scene.intersect(rays, coherence=coherence), hits)
        is_hit = hits["prim_id"] != morphray.INVALID_ID
        assert np.array_equal(scene.occluded(rays, coherence=coherence), is_hit)
        assert np.array_equal(scene.test_occlusions(rays, coherence=coherence), is_hit)
        cast = scene.cast_rays(rays, coherence=coherence)
        assert np.array_equal(cast["primitive_ids"], hits["prim_id"])
        assert np.array_equal(scene.count(rays, coherence=coherence), scene.count(rays))


def test_strided_and_unaligned_rays_are_read_rightly():
    points, triangles = grid(10)
    scene = morphray.Scene(points, triangles)
    rays = random_rays(points, 500)
    expected = scene.intersect(rays)
    assert_same_bits(scene.intersect(np.asfortranarray(rays)), expected)
    assert_same_bits(scene.intersect(rays[::-1])[::-1].copy(), expected)
    shifted = np.empty(rays.nbytes + 1, np.uint8)[1:].view(np.float32).reshape(rays.shape)
    shifted[:] = rays
    assert_same_bits(scene.intersect(shifted), expected)


def test_axes_in_front_are_kept():
    points, triangles = grid(10)
    scene = morphray.Scene(points, triangles)
    rays = random_rays(points, 600)
    expected = scene.intersect(rays)
    hits = scene.intersect(rays.reshape(20, 30, 8))
    assert_same_bits(hits, expected.reshape(20, 30))
    cast = scene.cast_rays(rays.reshape(20, 30, 8))
    assert cast["t_hit"].shape == (20, 30)
    assert cast["primitive_normals"].shape == (20, 30, 3)
    assert scene.occluded(rays.reshape(2, 300, 8)).shape == (2, 300)


def test_cast_rays_has_the_keys_of_open3d():
    points, triangles = grid(10)
    scene = morphray.Scene(points, triangles)
    rays = random_rays(points, RAYS)
    hits = scene.intersect(rays)
    is_hit = hits["prim_id"] != morphray.INVALID_ID
    cast = scene.cast_rays(rays)
    assert list(cast) == [
        "t_hit", "geometry_ids", "primitive_ids", "primitive_uvs", "primitive_normals",
    ]
    assert [a.dtype for a in cast.values()] == ["f4", "u4", "u4", "f4", "f4"]
    assert np.array_equal(cast["t_hit"], np.where(is_hit, hits["t"], np.inf).astype(np.float32))
    assert np.array_equal(cast["primitive_ids"], hits["prim_id"])
    assert np.array_equal(cast["geometry_ids"], hits["geom_id"])
    assert np.array_equal(cast["primitive_uvs"], np.stack([hits["u"], hits["v"]], axis=-1))
    corners = points.astype(np.float64)[triangles[hits["prim_id"][is_hit]]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert np.allclose(cast["primitive_normals"][is_hit], normals, rtol=0, atol=1e-6)
    assert not cast["primitive_normals"][~is_hit].any()


def test_occlusion_and_hit_of_a_triangle():
    scene = morphray.Scene(*triangle())
    hit = scene.intersect(DOWN)[0]
    assert hit.tolist() == (1, np.float32(0.2), np.float32(0.3), 0, 0)
    assert scene.occluded(DOWN).tolist() == scene.test_occlusions(DOWN).tolist() == [True]
    assert scene.test_occlusions(DOWN, tfar=0.9).tolist() == [False]
    assert scene.test_occlusions(DOWN, tnear=1.1).tolist() == [False]
    assert scene.test_occlusions(DOWN, 0.9, 1.1).tolist() == [True]


def test_no_rays_give_no_hits():
    scene = morphray.Scene(*triangle())
    for shape in [(0, 6), (0, 8), (3, 0, 6)]:
        rays = np.empty(shape, np.float32)
        assert scene.intersect(rays).shape == shape[:-1]
        assert scene.cast_rays(rays)["primitive_uvs"].shape == shape[:-1] + (2,)
        assert scene.test_occlusions(rays).shape == shape[:-1]


def test_results_are_written_to_out():
    points, triangles = grid(10)
    scene = morphray.Scene(points, triangles)
    rays = random_rays(points, RAYS)
    hits = np.empty(RAYS, morphray.hit_dtype)
    assert scene.intersect(rays, hits) is hits
    assert_same_bits(hits, scene.intersect(rays))
    bits = np.empty(RAYS, bool)
    assert scene.occluded(rays, out=bits) is bits
    assert np.array_equal(bits, scene.occluded(rays))
    part = np.zeros(RAYS + 2, morphray.hit_dtype)
    scene.intersect(rays, part[1:-1])
    assert_same_bits(part[1:-1].copy(), hits)
    assert part[0] == part[-1] == np.zeros((), morphray.hit_dtype)
