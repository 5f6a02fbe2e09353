"""All hits, insides and closest points: against arithmetic of numpy, and the same on all devices."""

import numpy as np
import pytest

import morphray
from scenes import DOWN, assert_same_bits, cube, devices, grid, random_rays, six, sphere, triangle

POINTS = 2000


def random_points(count=POINTS, seed=2, size=1.5):
    return np.random.default_rng(seed).uniform(-size, size, (count, 3)).astype(np.float32)


def answers(scene, rays, points):
    all_hits = scene.intersect_all(rays)
    each = scene.intersect_all(rays, crossing="each", max_hits=2)
    return [*all_hits, *each, scene.count(rays), scene.count(rays, crossing="each"),
            scene.winding(points), scene.contains(points), scene.contains(points, rule="odd"),
            scene.closest_points(points), scene.closest_points(points, 0.25),
            scene.signed_distance(points), scene.signed_distance(points, rule="odd")]


def test_all_devices_answer_with_the_same_bits():
    points, triangles = sphere(8)
    both = [(points, triangles), (points * np.float32(0.5) + np.float32(0.7), triangles)]
    rays, where = random_rays(points, 500), random_points(500)
    where[0], where[1] = points[0], np.nan
    scenes = [morphray.Scene(both, device=device) for device in devices()]
    expected = answers(scenes[-1], rays, where)
    for scene in scenes[:-1]:
        for a, b in zip(answers(scene, rays, where), expected):
            assert_same_bits(a, b)


def test_all_hits_are_those_that_a_ray_meets_one_after_the_other():
    points, triangles = grid(20)
    # Along the sheet, through several bumps.
    random = np.random.default_rng(4)
    rays = np.zeros((500, 8), np.float32)
    rays[:, :3] = random.uniform((-1, 0, 0), (-0.5, 1, 0.2), (500, 3))
    rays[:, 4:7] = random.uniform((1, -0.2, -0.02), (1, 0.2, 0.02), (500, 3))
    rays[:, 7] = np.where(random.random(500) < 0.2, 1, np.inf)
    scene = morphray.Scene(points, triangles)
    all_hits = scene.intersect_all(rays)
    assert all_hits.hits.dtype == morphray.hit_dtype
    assert all_hits.offsets.dtype == all_hits.left_out.dtype == np.int64
    assert all_hits.offsets.shape == (501,) and not all_hits.left_out.any()
    assert len(all_hits.hits) == all_hits.offsets[-1] > 500
    assert np.array_equal(scene.count(rays), np.diff(all_hits.offsets))
    assert np.diff(all_hits.offsets).max() > 2
    closest = scene.intersect(rays)
    for ray in range(500):
        hits = all_hits.of_ray(ray)
        order = list(zip(hits["t"], hits["geom_id"], hits["prim_id"]))
        assert order == sorted(order) and len(set(hits["prim_id"])) == len(hits)
        hit = closest[ray:ray + 1]
        assert_same_bits(hits[:1].copy(), hit[hit["prim_id"] != morphray.INVALID_ID])
        # The next one is the closest beyond this one.
        for i in range(len(hits) - 1):
            beyond = rays[ray:ray + 1].copy()
            beyond[0, 3] = np.nextafter(hits["t"][i], np.float32(np.inf))
            assert_same_bits(scene.intersect(beyond), hits[i + 1:i + 2].copy())


def test_hits_beyond_max_hits_are_counted():
    points, triangles = sphere()
    scene = morphray.Scene([(points * np.float32(size), triangles) for size in (1, 2, 3)])
    ray = np.array([[-5, 0.1, 0.2, 1, 0, 0], [0, 9, 0, 1, 0, 0]], np.float32)
    whole = scene.intersect_all(ray)
    assert whole.hits["geom_id"].tolist() == [2, 1, 0, 0, 1, 2]
    for max_hits in [0, 1, 5, 6, 2**32 - 1]:
        part = scene.intersect_all(ray, max_hits=max_hits)
        listed = min(max_hits, 6)
        assert part.offsets.tolist() == [0, listed, listed]
        assert part.left_out.tolist() == [6 - listed, 0]
        assert_same_bits(part.hits, whole.hits[:listed].copy())


def test_rays_of_all_layouts_are_the_same_rays():
    points, triangles = grid(3)
    scene = morphray.Scene(points, triangles)
    rays = random_rays(points, 300_000)  # more than a batch has
    rays[:, 3], rays[:, 7] = 0, np.inf
    expected = scene.count(rays)
    assert np.array_equal(scene.count(six(rays)), expected)
    assert np.array_equal(np.diff(scene.intersect_all(six(rays)).offsets), expected)
    fields = np.ascontiguousarray(rays).view(morphray.ray_dtype)[:, 0]
    assert np.array_equal(scene.count(fields[::-1])[::-1], expected)
    assert np.array_equal(scene.count(rays.reshape(3, 100_000, 8)), expected.reshape(3, -1))


def test_winding_adds_up_over_meshes():
    points, triangles = sphere(24)
    scene = morphray.Scene([(points, triangles), (points + np.float32([1, 0, 0]), triangles),
                            (points * np.float32(0.3), triangles[:, ::-1].copy())])
    where = random_points(size=2.5)
    inside = [np.linalg.norm(where - [x, 0, 0], axis=1) for x in (0, 1)]
    small = np.linalg.norm(where, axis=1)
    # The spheres have flat sides.
    sure = np.abs(inside[0] - 1) > 0.02
    sure &= (np.abs(inside[1] - 1) > 0.02) & (np.abs(small - 0.3) > 0.02)
    expected = (inside[0] < 1).astype(int) + (inside[1] < 1) - (small < 0.3)
    winding = scene.winding(where)
    assert winding.dtype == np.int32 and set(expected[sure]) == {0, 1, 2}
    assert np.array_equal(winding[sure], expected[sure])
    assert np.array_equal(scene.contains(where)[sure], expected[sure] != 0)
    odd = scene.contains(where, rule="odd")
    assert odd.dtype == np.bool_
    assert np.array_equal(odd[sure], ((inside[0] < 1) ^ (inside[1] < 1) ^ (small < 0.3))[sure])
    signed = scene.signed_distance(where)
    assert np.array_equal(signed < 0, winding != 0)
    assert_same_bits(np.abs(signed), scene.closest_points(where)["distance"].copy())


def closest_by_numpy(points, triangles, where):
    """The least distance over all edges and all projections that lie inside of their triangle."""
    p = points.astype(np.float64)[triangles]
    q = where.astype(np.float64)[:, None]
    best = np.full((len(where), len(triangles)), np.inf)
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    height = ((q - p[:, 0]) * normal).sum(-1)
    inside = np.ones(best.shape, bool)
    for i in range(3):
        start, edge = p[:, i], p[:, (i + 1) % 3] - p[:, i]
        s = np.clip(((q - start) * edge).sum(-1) / (edge * edge).sum(-1), 0, 1)
        best = np.minimum(best, np.linalg.norm(q - start - s[..., None] * edge, axis=-1))
        inside &= (np.cross(edge, q - start) * normal).sum(-1) > 0
    return np.where(inside, np.abs(height), best)


def test_closest_points_are_those_of_numpy():
    points, triangles = grid(8)
    scene = morphray.Scene(points, triangles)
    where = random_points(500)
    by_triangle = closest_by_numpy(points, triangles, where)
    closest = scene.closest_points(where)
    assert closest.dtype == morphray.closest_dtype
    least = by_triangle.min(axis=1)
    assert np.abs(closest["distance"] - least).max() < 1e-6
    chosen = by_triangle[np.arange(500), closest["prim_id"]]
    assert np.abs(chosen - least).max() < 1e-6 and not closest["geom_id"].any()
    p0, p1, p2 = np.moveaxis(points[triangles[closest["prim_id"]]], 1, 0)
    u, v = closest["u"][:, None], closest["v"][:, None]
    assert np.abs(closest["point"] - ((1 - u - v) * p0 + u * p1 + v * p2)).max() < 1e-6
    apart = np.linalg.norm(closest["point"] - where, axis=1)
    assert np.abs(apart - closest["distance"]).max() < 1e-6
    weights = np.stack([u[:, 0], v[:, 0], 1 - (u + v)[:, 0]])
    assert np.array_equal((weights == 0).sum(axis=0), closest["feature"])
    assert set(closest["feature"]) == {0, 1, 2}


def test_nothing_is_found_beyond_max_distance():
    scene = morphray.Scene(*triangle())
    above = np.array([[0.25, 0.25, 2]], np.float32)
    assert scene.closest_points(above, 2.5)["distance"] == 2
    assert scene.closest_points(above, max_distance=np.inf)["prim_id"] == 0
    for nothing in [scene.closest_points(above, 1.5)[0], scene.closest_points(above, 0)[0]]:
        assert nothing["distance"] == np.inf and nothing["point"].tolist() == [0, 0, 0]
        assert nothing["prim_id"] == nothing["geom_id"] == morphray.INVALID_ID
        assert (nothing["u"], nothing["v"], nothing["feature"]) == (0, 0, 0)
    assert scene.signed_distance(above, max_distance=2).tolist() == [2]
    assert scene.signed_distance(above, max_distance=1.5).tolist() == [np.inf]
    inside = np.array([[0.5, 0.5, 0.5]], np.float32)
    assert morphray.Scene(*cube()).signed_distance(inside, max_distance=0.25).tolist() == [-np.inf]
    for bad in [-1, np.nan]:
        for ask in [scene.closest_points, scene.signed_distance]:
            with pytest.raises(morphray.Error) as caught:
                ask(above, max_distance=bad)
            assert caught.value.code == "bad_argument"


def test_answers_follow_the_points():
    points, triangles = cube()
    scene = morphray.Scene(points, triangles)
    where = np.array([[0.5, 0.5, 0.5]], np.float32)
    assert scene.signed_distance(where).tolist() == [-0.5]
    points += np.float32(2)
    assert scene.contains(where).tolist() == [True]  # until the update
    scene.update()
    assert scene.contains(where).tolist() == [False] and scene.winding(where).tolist() == [0]
    assert scene.closest_points(where)["point"].tolist() == [[2, 2, 2]]
    assert scene.count(np.array([[2.5, 2.25, 0, 0, 0, 1]], np.float32)).tolist() == [2]


def test_scenes_without_triangles_and_no_queries_have_answers():
    where = random_points(5)
    for scene in [morphray.Scene([]), morphray.Scene(triangle()[0], np.zeros((0, 3), np.uint32))]:
        assert scene.intersect_all(DOWN).offsets.tolist() == [0, 0]
        assert scene.count(DOWN).tolist() == [0]
        assert not scene.winding(where).any() and not scene.contains(where).any()
        assert (scene.signed_distance(where) == np.inf).all()
        assert (scene.closest_points(where)["prim_id"] == morphray.INVALID_ID).all()
    scene = morphray.Scene(*triangle())
    for shape in [(0, 6), (3, 0, 8)]:
        rays = np.empty(shape, np.float32)
        assert scene.count(rays).shape == shape[:-1]
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
        (scene.count, rays, np.int64), (scene.winding, where, np.int32),
        (scene.contains, where, np.bool_), (scene.signed_distance, where, np.float32),
    ]:
        out = np.empty(asked.shape[:-1], dtype)
        assert ask(asked, out) is out
        assert_same_bits(ask(asked), out)
    out = np.empty((20, 20), morphray.closest_dtype)
    assert scene.closest_points(where, out=out) is out
    assert_same_bits(scene.closest_points(where), out)
    assert_same_bits(scene.closest_points(where[:, ::-1])[:, ::-1].copy(), out)
