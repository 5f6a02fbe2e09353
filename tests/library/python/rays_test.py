"""Queries answer as brute force does, bit by bit."""

import numpy as np
import pytest

import morphray
from scenes import DOWN, assert_same_bits, grid, random_rays, six, triangle

RAYS = 3000


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


@pytest.mark.parametrize("coherence", ["none", "sort", 0, 700, 2**32 - 1])
def test_answers_are_the_same_whatever_is_said_of_the_rays(coherence):
    points, triangles = grid(20)
    scene = morphray.Scene(points, triangles)
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 700), np.linspace(-0.5, 0.5, 400))
    image = np.empty((400, 700, 6), np.float32)
    image[..., :3] = 0.4, 0.3, 2
    image[..., 3:] = np.stack([x, y, -2 + 0 * x], axis=-1)
    hits = scene.intersect(image)
    assert_same_bits(scene.intersect(image, coherence=coherence), hits)
    is_hit = hits["prim_id"] != morphray.INVALID_ID
    assert np.array_equal(scene.occluded(image, coherence=coherence), is_hit)
    assert np.array_equal(scene.count(image, coherence=coherence), scene.count(image))


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
    assert scene.occluded(rays.reshape(2, 300, 8)).shape == (2, 300)


def test_occlusion_and_hit_of_a_triangle():
    scene = morphray.Scene(*triangle())
    hit = scene.intersect(DOWN)[0]
    assert hit.tolist() == (1, np.float32(0.2), np.float32(0.3), 0, 0)
    assert scene.occluded(DOWN).tolist() == [True]
    for tnear, tfar, is_hit in [(0, 0.9, False), (1.1, np.inf, False), (0.9, 1.1, True)]:
        limited = np.array([[0.2, 0.3, 1, tnear, 0, 0, -1, tfar]], np.float32)
        assert scene.occluded(limited).tolist() == [is_hit]


def test_no_rays_give_no_hits():
    scene = morphray.Scene(*triangle())
    for shape in [(0, 6), (0, 8), (3, 0, 6)]:
        rays = np.empty(shape, np.float32)
        assert scene.intersect(rays).shape == shape[:-1]
        assert scene.occluded(rays).shape == shape[:-1]


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


class FromDlpack:
    """An array of another library."""

    def __init__(self, array):
        self.array = array

    def __dlpack__(self, **kwargs):
        return self.array.__dlpack__(**kwargs)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


def test_numbers_of_all_kinds_are_taken():
    points, triangles = triangle()
    scene = morphray.Scene(points, triangles)
    hits = scene.intersect(DOWN)
    for rays in (DOWN.astype(np.float64), DOWN.tolist(), FromDlpack(DOWN)):
        assert_same_bits(scene.intersect(rays), hits)
    assert_same_bits(scene.intersect(DOWN[0]), hits[0])
    assert scene.occluded(DOWN[0].tolist()).shape == ()
    assert scene.closest_points([0.2, 0.2, 1])["distance"] == 1
    doubles = points.astype(np.float64)
    for mesh in (doubles, points.tolist(), FromDlpack(points)):
        assert_same_bits(morphray.Scene(mesh, triangles.tolist()).intersect(DOWN), hits)
    moving = morphray.Scene(doubles, triangles)
    doubles[:, 2] += 0.5
    points[:, 2] += 0.5
    moving.update()
    scene.update()
    assert_same_bits(moving.intersect(DOWN), scene.intersect(DOWN))


def test_rays_see_some_triangles():
    points, triangles = triangle()
    scene = morphray.Scene([(points, triangles), (points - np.float32([0, 0, 1]), triangles)])
    near = scene.intersect(DOWN)
    seen = near["prim_id"] != morphray.INVALID_ID
    assert seen.any()
    far = scene.intersect(DOWN, visible=np.array([False, True]))
    assert (far["geom_id"][seen] == 1).all()
    assert_same_bits(scene.intersect(DOWN, excluded=near), far)
    ids = np.stack([near["geom_id"], near["prim_id"]], axis=-1)
    assert_same_bits(scene.intersect(DOWN, excluded=ids), far)
    assert (scene.count(DOWN, excluded=near)[seen] == 1).all()
    assert (scene.intersect_all(DOWN, excluded=near).hits["geom_id"] == 1).all()
    assert not scene.occluded(DOWN, visible=np.zeros(2, bool)).any()
    for size in (0, 1, 3):
        with pytest.raises(morphray.Error, match=f"visible: {size} flags, but 2 geom_ids"):
            scene.occluded(DOWN, visible=np.ones(size, bool))
    assert morphray.Scene([]).occluded(DOWN, visible=np.ones(0, bool)).shape == DOWN.shape[:-1]


def test_empty_lists_and_arrays_of_others_are_taken():
    points, triangles = triangle()

    class Frame:
        def __init__(self, array):
            self.array = array

        def __array__(self, dtype=None, copy=None):
            return self.array

    scene = morphray.Scene(Frame(points), Frame(triangles))
    assert_same_bits(scene.intersect(Frame(DOWN)), morphray.Scene(points, triangles).intersect(DOWN))
    assert scene.intersect([]).shape == scene.occluded([], excluded=[]).shape == (0,)
    assert scene.intersect_all([]).offsets.tolist() == [0]
    assert scene.contains([]).shape == scene.closest_points([]).shape == (0,)
    assert morphray.Scene(points, []).triangle_count == morphray.Scene([], []).vertex_count == 0
    assert scene.attach([], []) == 1
    unmasked = np.ma.masked_equal(points, 9)
    assert_same_bits(morphray.Scene(unmasked, triangles).intersect(DOWN), scene.intersect(DOWN))


def test_normals_of_hits():
    points, triangles = triangle()
    scene = morphray.Scene(points, triangles)
    hits = scene.intersect(DOWN)
    seen = hits["prim_id"] != morphray.INVALID_ID
    for smooth in (False, True):
        normals = scene.normals(hits, smooth=smooth)
        assert np.allclose(np.abs(normals[seen]), [0, 0, 1])
        assert not normals[~seen].any()
    closest = scene.closest_points(points)
    assert np.allclose(scene.normals(closest), normals[seen][0])
