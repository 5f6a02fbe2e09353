"""Hits, all hits, insides and closest points, in arrays of their dtypes."""

import warnings

import numpy as np
import pytest

import morphray
from scenes import DOWN, assert_same_bits, cube, grid, random_rays, six, sphere, triangle


def random_points(count, seed=2, size=1.5):
    return np.random.default_rng(seed).uniform(-size, size, (count, 3)).astype(np.float32)


def test_rays_of_all_layouts_are_the_same_rays():
    points, triangles = grid(3)
    scene = morphray.Scene(points, triangles)
    rays = random_rays(points, 300_000)  # more than a batch has
    rays[:, 3], rays[:, 7] = 0, np.inf
    fields = np.ascontiguousarray(rays).view(morphray.ray_dtype)[:, 0]
    shifted = np.empty(rays.nbytes + 1, np.uint8)[1:].view(np.float32).reshape(rays.shape)
    shifted[:] = rays
    for ask in [scene.intersect, scene.occluded, scene.count]:
        expected = ask(rays)
        for same in [six(rays), fields, np.asfortranarray(rays), shifted]:
            assert_same_bits(ask(same), expected)
        assert_same_bits(ask(fields[::-1])[::-1].copy(), expected)
        assert_same_bits(ask(rays.reshape(3, 100_000, 8)), expected.reshape(3, -1))
        for coherence in ["none", "sort", 0, 70, 2**32 - 1]:
            assert_same_bits(ask(rays, coherence=coherence), expected)
    assert np.array_equal(np.diff(scene.intersect_all(six(rays)).offsets), expected)


def test_occlusion_and_hit_of_a_triangle():
    scene = morphray.Scene(*triangle())
    hit = scene.intersect(DOWN)[0]
    assert hit.tolist() == (1, np.float32(0.2), np.float32(0.3), 0, 0)
    assert scene.occluded(DOWN).tolist() == [True]
    for tnear, tfar, is_hit in [(0, 0.9, False), (1.1, np.inf, False), (0.9, 1.1, True)]:
        limited = np.array([[0.2, 0.3, 1, tnear, 0, 0, -1, tfar]], np.float32)
        assert scene.occluded(limited).tolist() == [is_hit]


def test_answers_have_their_dtypes():
    points, triangles = cube()
    scene = morphray.Scene([(points + np.float32(4), triangles), (points, triangles)])
    where = np.array([[0.5, 0.25, 3], [2, 2, 2], [0.5, 0.5, 0.75]], np.float32)
    closest = scene.closest_points(where)
    assert closest.dtype == morphray.closest_dtype
    assert closest["point"].tolist() == [[0.5, 0.25, 1], [1, 1, 1], [0.5, 0.5, 1]]
    assert closest["distance"].tolist() == [2, np.float32(3**0.5), 0.25]
    assert closest["feature"].tolist() == [0, 2, 1] and set(closest["geom_id"]) == {1}
    p0, p1, p2 = np.moveaxis(points[triangles[closest["prim_id"]]], 1, 0)
    u, v = closest["u"][:, None], closest["v"][:, None]
    assert ((1 - u - v) * p0 + u * p1 + v * p2 == closest["point"]).all()
    winding, inside = scene.winding(where), scene.contains(where, rule="odd")
    assert winding.tolist() == [0, 0, 1] and winding.dtype == np.int32
    assert inside.tolist() == [False, False, True] and inside.dtype == np.bool_
    assert scene.signed_distance(where).tolist() == [2, np.float32(3**0.5), -0.25]
    ray = np.array([[0.5, 0.25, 3, 0, 0, -1]], np.float32)
    first = scene.intersect_all(ray, max_hits=1, crossing="each")
    assert first.offsets.tolist() == [0, 1] and first.left_out.tolist() == [1]
    all_hits = scene.intersect_all(ray)
    assert all_hits.offsets.tolist() == [0, 2] and all_hits.hits["t"].tolist() == [2, 3]
    assert all_hits.hits.dtype == morphray.hit_dtype and not all_hits.left_out.any()
    assert all_hits.offsets.dtype == all_hits.left_out.dtype == np.int64


def test_open_edges_are_counted():
    points, triangles = cube()
    assert morphray.Scene(points, triangles).edge_counts().is_closed
    scene = morphray.Scene([(points, triangles[1:]), (points, triangles[:, ::-1])])
    edges = scene.edge_counts()
    assert not edges.is_closed and (edges.open, edges.turned) == (0, 0)
    assert edges.uneven == 3 and edges.shared > 0 and edges.twins == 22
    assert "22 twins" in repr(edges)


def test_a_scene_warns_once_where_insides_are_not_those_of_a_solid():
    points, triangles = cube()
    turned = triangles.copy()
    turned[0] = turned[0, ::-1]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        morphray.Scene(points, triangles).contains(points)
        scene = morphray.Scene(points, turned)
        scene.signed_distance(points, rule="odd")
        scene.closest_points(points)
    with pytest.warns(UserWarning, match='3 turned;.*; rule="odd" is right where') as told:
        scene.contains(points)
        scene.signed_distance(points)
    assert len(told) == 1
    with pytest.warns(UserWarning, match="edges: 3 open, .* need closed meshes$"):
        morphray.Scene(points, triangles[1:]).winding(points)


def test_nothing_is_found_beyond_max_distance():
    scene = morphray.Scene(*triangle())
    above = np.array([[0.25, 0.25, 2]], np.float32)
    assert scene.closest_points(above, 2.5)["distance"] == 2
    nothing = scene.closest_points(above, max_distance=1.5)[0]
    assert nothing["distance"] == np.inf and nothing["point"].tolist() == [0, 0, 0]
    assert nothing["prim_id"] == nothing["geom_id"] == morphray.INVALID_ID
    assert (nothing["u"], nothing["v"], nothing["feature"]) == (0, 0, 0)
    assert scene.signed_distance(above, max_distance=2).tolist() == [2]
    assert scene.signed_distance(above, max_distance=1.5).tolist() == [np.inf]


def test_scenes_without_triangles_and_no_queries_have_answers():
    where = random_points(5)
    for scene in [morphray.Scene([]), morphray.Scene(triangle()[0], np.zeros((0, 3), np.uint32))]:
        scene.update()
        assert scene.intersect(DOWN)["prim_id"] == morphray.INVALID_ID and not scene.occluded(DOWN)
        assert scene.intersect_all(DOWN).offsets.tolist() == [0, 0]
        assert (scene.closest_points(where)["prim_id"] == morphray.INVALID_ID).all()
        assert scene.render((4, 4)).hits["prim_id"].min() == morphray.INVALID_ID
        assert (scene.bounds[0] > scene.bounds[1]).all()
    scene = morphray.Scene(*triangle())
    for shape in [(0, 6), (3, 0, 8)]:
        rays = np.empty(shape, np.float32)
        for ask in [scene.intersect, scene.occluded, scene.count]:
            assert ask(rays).shape == shape[:-1]
        assert scene.intersect_all(rays).offsets.tolist() == [0]
        assert scene.intersect_all(rays).ray_ids.shape == (0,)
    for shape in [(0, 3), (3, 0, 3)]:
        nowhere = np.empty(shape, np.float32)
        for ask in [scene.winding, scene.contains, scene.closest_points, scene.signed_distance]:
            assert ask(nowhere).shape == shape[:-1]


def test_results_are_written_to_out():
    points, triangles = sphere()
    scene = morphray.Scene(points, triangles)
    rays, where = random_rays(points, 400), random_points(400).reshape(20, 20, 3)
    for ask, asked, dtype in [
        (scene.intersect, rays, morphray.hit_dtype), (scene.occluded, rays, np.bool_),
        (scene.count, rays, np.int64), (scene.winding, where, np.int32),
        (scene.contains, where, np.bool_), (scene.signed_distance, where, np.float32),
    ]:
        out = np.empty(asked.shape[:-1], dtype)
        assert ask(asked, out) is out
        assert_same_bits(ask(asked), out)
    part = np.zeros(402, morphray.hit_dtype)
    scene.intersect(rays, part[1:-1])
    assert_same_bits(part[1:-1].copy(), scene.intersect(rays))
    assert part[0] == part[-1] == np.zeros((), morphray.hit_dtype)
    out = np.empty((20, 20), morphray.closest_dtype)
    assert scene.closest_points(where, out=out) is out
    assert_same_bits(scene.closest_points(where), out)
    assert_same_bits(scene.closest_points(where[:, ::-1])[:, ::-1].copy(), out)


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
    for mesh in (points.astype(np.float64), points.tolist(), FromDlpack(points)):
        assert_same_bits(morphray.Scene(mesh, triangles.tolist()).intersect(DOWN), hits)


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
    body = np.full((*DOWN.shape[:-1], 2), [0, -1])
    assert_same_bits(scene.intersect(DOWN, excluded=body), far)
    assert (scene.count(DOWN, excluded=near)[seen] == 1).all()
    assert (scene.intersect_all(DOWN, excluded=near).hits["geom_id"] == 1).all()
    assert not scene.occluded(DOWN, visible=np.zeros(2, bool)).any()
    assert morphray.Scene([]).occluded(DOWN, visible=np.ones(0, bool)).shape == DOWN.shape[:-1]


def test_points_see_some_triangles():
    ball, triangles = sphere(8)
    scene = morphray.Scene([(ball, triangles), (0.5 * ball, triangles)])
    where = random_points(300).reshape(20, 15, 3)
    body = np.full((20, 15, 2), [0, -1])
    for ask in (scene.winding, scene.contains, scene.closest_points, scene.signed_distance):
        without = ask(where, visible=np.array([False, True]))
        assert_same_bits(ask(where, excluded=body), without)
        assert (without != ask(where)).any()
    closest = scene.closest_points(where)
    ids = np.stack([closest["geom_id"], closest["prim_id"]], axis=-1)
    second = scene.closest_points(where, excluded=ids)
    assert (second["prim_id"] != closest["prim_id"]).all()
    assert_same_bits(scene.closest_points(where, excluded=closest), second)
    far = morphray.Scene([(ball, triangles), (0.5 * ball, triangles)], bounds=scene.bounds, origin=(0, 0, 2**-30))
    assert far.closest_points(where, excluded=far.closest_points(where)).dtype["point"].base == np.float64


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


def test_crossings_are_pairs_of_triangles():
    sheet, sheet_triangles = triangle()
    blade = np.array([[0.2, 0.2, -1], [0.2, 0.2, 1], [0.3, -1, 0]], np.float32)
    scene = morphray.Scene(sheet, sheet_triangles)
    assert not scene.has_crossings() and scene.crossings(count=True) == 0
    other = scene.attach(blade, [[0, 1, 2]])
    scene.update()
    found = scene.crossings()
    assert found.pairs.shape == (1, 2, 2) and found.pairs.dtype == np.uint32
    assert found.pairs[0, :, 0].tolist() == [0, other]
    assert scene.crossings([0], [other], count=True) == 1 and scene.has_crossings(other=[0])
    limited = scene.crossings(limit=0, visible=[True, True])
    assert limited.left_out == 1 and limited.pairs.shape == (0, 2, 2)
    assert scene.crossings([], count=True) == 0
