"""Arrays that are borrowed, and trees that follow them."""

import gc
import tracemalloc
import weakref

import numpy as np
import pytest

import morphray
from scenes import DOWN, assert_same_bits, brute_force, grid, random_rays, triangle

BOUNDS = ((-2, -2, -2), (3, 3, 3))


def test_update_reads_the_array_in_place():
    points, triangles = triangle()
    scene = morphray.Scene(points, triangles, bounds=BOUNDS)
    address = points.ctypes.data
    points[:, 2] = -1
    assert scene.intersect(DOWN)["t"] == 1  # until the update
    assert scene.update().step == "refit"
    assert scene.intersect(DOWN)["t"] == 2
    assert points.ctypes.data == address
    assert scene.update().step == "keep"


def test_points_are_not_copied():
    points = np.zeros((1_000_000, 3), np.float32)
    triangles = np.array([[0, 1, 2]], np.uint32)
    tracemalloc.start()  # numpy reports its arrays to it
    scene = morphray.Scene(points, triangles)
    scene.update()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 100_000


def test_each_policy_is_taken():
    points, triangles = grid(16)
    steps = {"auto": "refit", "refit": "refit", "rebuild": "rebuild", "every:2": "refit"}
    for update, step in steps.items():
        scene = morphray.Scene(points, triangles, update=update, bounds=BOUNDS)
        points *= np.float32(1.01)
        assert scene.update().step == step
    points *= np.float32(7)
    scene.update_with_new_bounds()
    lower, upper = scene.bounds
    assert lower.dtype == upper.dtype == np.float64
    assert np.allclose([lower, upper], [points.min(axis=0), points.max(axis=0)], atol=1e-5)


def test_update_tells_what_it_did():
    points, triangles = grid(16)
    scene = morphray.Scene(points, triangles, update="refit", record_cost_ratio=True)
    np.random.default_rng(1).shuffle(points)
    done = scene.update()
    assert done.cost_ratio not in (0, 1) and not done.build_pending
    parts = ["read_ms", "upload_ms", "refit_ms", "decide_ms", "restructure_ms", "rebuild_ms"]
    assert done.milliseconds == pytest.approx(sum(getattr(done, part) for part in parts))
    assert scene.last_update().step == "refit"
    assert "refit" in repr(done)
    assert morphray.Scene(points, triangles, update="refit").update().cost_ratio == 1


def test_field_of_a_structured_array_is_read_in_place():
    points, triangles = grid(8)
    rays = random_rays(points, 1000)
    vertices = np.zeros(len(points), [("normal", "i1", 5), ("position", "f4", (3,))])
    vertices["position"] = points
    scene = morphray.Scene(vertices["position"], triangles, bounds=BOUNDS)
    # A slice of every second element.
    twice = np.zeros(2 * len(points), vertices.dtype)[::2]
    twice["position"] = points
    other = morphray.Scene(twice["position"], triangles, bounds=BOUNDS)
    assert_same_bits(other.intersect(rays), scene.intersect(rays))
    vertices["position"][:, 2] += np.float32(0.5)
    scene.update()
    points[:, 2] += np.float32(0.5)
    assert_same_bits(scene.intersect(rays), brute_force(points, triangles, rays, bounds=BOUNDS))


def test_read_only_points_are_fine():
    points, triangles = triangle()
    points.flags.writeable = False
    assert morphray.Scene(points, triangles).intersect(DOWN)["prim_id"] == 0


def test_scene_keeps_the_array_that_its_caller_forgot():
    points, triangles = grid(8)
    rays = random_rays(points, 1000)
    expected = brute_force(points, triangles, rays)
    alive = weakref.ref(points)
    scene = morphray.Scene(points, triangles)
    twin = scene.on("brute")
    del points, triangles
    gc.collect()
    assert alive() is not None
    scene.update()
    assert_same_bits(scene.intersect(rays), expected)
    del scene
    assert alive() is not None
    twin.update()
    assert_same_bits(twin.intersect(rays), expected)
    del twin
    assert alive() is None


def test_pose_in_another_buffer():
    points, triangles = triangle()
    buffers = [points, points.copy()]
    scene = morphray.Scene(buffers[0], triangles, bounds=BOUNDS)
    alive = weakref.ref(buffers[0])
    for step in range(1, 4):
        pose = buffers[step % 2]
        pose[:, 2] = -step / 4
        assert scene.update(0, pose).step == "refit"
        assert scene.intersect(DOWN)["t"] == 1 + step / 4
    del points, pose, buffers[0]
    gc.collect()
    assert alive() is None
    for wrong, error in [(buffers[0][:2], morphray.Error), (buffers[0].astype(np.int64), TypeError)]:
        with pytest.raises(error):
            scene.update(0, wrong)
    assert scene.update().step == "keep"


def test_several_meshes():
    first, triangles = triangle()
    second = first + np.float32([0, 0, 0.5])
    third = first + np.float32([0, 0, -1])
    scene = morphray.Scene([(first, triangles), morphray.Mesh(second, triangles, deforms=False)])
    assert scene.triangle_count == 2 and scene.vertex_count == 6
    assert scene.intersect(DOWN)["geom_id"] == 1
    second[:, 2] = -5
    assert scene.update().step == "keep"
    assert scene.intersect(DOWN)["t"] == 0.5
    scene.detach(1)
    assert scene.attach(third, triangles) == 1
    scene.update()
    assert scene.intersect(DOWN)["geom_id"] == 0
    scene.detach(0)
    scene.update()
    assert scene.intersect(DOWN)["geom_id"] == 1
    with pytest.raises(morphray.Error):
        scene.detach(0)


@pytest.mark.parametrize("dtype", ["u4", "i4", "u8", "i8"])
def test_triangles_of_each_integer_type(dtype):
    points, triangles = grid(8)
    rays = random_rays(points, 200)
    other = np.asfortranarray(triangles.astype(dtype))
    scene = morphray.Scene(points, other)
    other[:] = 0  # they were copied
    scene.update()
    assert_same_bits(scene.intersect(rays), brute_force(points, triangles, rays))
