"""The GIL is released while work runs, and calls that do not go together are told so."""

import os
import signal
import threading
import time

import numpy as np
import pytest

import morphray
from scenes import grid, random_rays


def assert_gil_is_released(work):
    """A call that held the GIL would let the other thread count once or twice, at its ends."""
    end = threading.Event()
    times = []

    def count():
        while not end.wait(0.0005):
            times.append(time.perf_counter())

    thread = threading.Thread(target=count)
    thread.start()
    begin = time.perf_counter()
    work()
    done = time.perf_counter()
    end.set()
    thread.join()
    assert done - begin > 0.02, "too short to tell"
    assert sum(begin < at < done for at in times) > 5


@pytest.fixture(scope="module")
def large():
    return grid(500)


@pytest.fixture(scope="module")
def brute():
    points, triangles = grid(100)
    return morphray.Scene(points, triangles, device=morphray.Device.brute_force(threads=1))


def test_build_releases_the_gil(large):
    device = morphray.Device.cpu(threads=1)
    assert_gil_is_released(lambda: morphray.Scene(*large, device=device))


def test_queries_release_the_gil(brute):
    rays = random_rays(grid(100)[0], 3000)
    for call in [brute.intersect, brute.occluded]:
        assert_gil_is_released(lambda: call(rays))
    where = rays[:1000, :3].copy()
    for call, queries in [
        (brute.intersect_all, rays[:100]), (brute.count, rays[:100]), (brute.winding, where),
        (brute.contains, where), (brute.closest_points, where[:100]),
        (brute.signed_distance, where[:100]),
    ]:
        assert_gil_is_released(lambda: call(queries))
    assert_gil_is_released(lambda: morphray.compare(brute, brute, rays))
    assert_gil_is_released(lambda: brute.render((64, 64)))


def test_query_during_an_update_is_busy(large):
    points, triangles = large
    points = points.copy()
    scene = morphray.Scene(points, triangles, update="rebuild")
    ray = random_rays(points, 1)
    end = threading.Event()

    def change():
        while not end.is_set():
            points[0, 2] += np.float32(0.001)
            try:
                scene.update()
            except morphray.Error as error:
                assert error.code == "busy"

    thread = threading.Thread(target=change)
    thread.start()
    with pytest.raises(morphray.Error) as caught:
        while thread.is_alive():
            scene.intersect(ray)
    end.set()
    thread.join()
    assert caught.value.code == "busy"
    scene.update()
    assert scene.intersect(ray).shape == (1,)


def test_a_forked_child_answers_unless_threads_were_at_work(brute):
    """Their locks are held for good in the child, so it is told so instead of waiting."""
    points, triangles = grid(60)
    scene = morphray.Scene(points, triangles, device=morphray.Device.cpu(threads=4))
    rays = random_rays(points, 20_000)
    expected = scene.intersect(rays)

    def in_child():
        child = os.fork()
        if child == 0:
            signal.alarm(60)  # ends a child that waits
            code = 1
            try:
                code = 0 if scene.intersect(rays).tobytes() == expected.tobytes() else 2
                scene.update()
                morphray.Scene(points, triangles).intersect(rays)
            except morphray.Error as error:
                code = 3 if error.code == "unavailable" and "fork" in str(error) else 4
            finally:
                os._exit(code)
        return os.waitpid(child, 0)[1]

    assert in_child() == 0
    cancel = morphray.Cancel()

    def query():
        with pytest.raises(morphray.Error):
            brute.intersect(random_rays(points, 10_000_000), cancel=cancel)

    thread = threading.Thread(target=query)
    thread.start()
    while not (status := in_child()):
        time.sleep(0.01)
    cancel.set()
    thread.join()
    assert os.waitstatus_to_exitcode(status) == 3
    assert in_child() == 0
