"""Ctrl-C ends long calls, and Cancel images and queries. What nothing ends would take many minutes."""

import os
import subprocess
import sys
import threading

import pytest

import morphray
from scenes import grid, random_rays

# Each call is alone in a process, and would take several minutes. The tests wait for 90 seconds.
PROGRAM = """
import os, signal, sys, threading, time
import numpy as np
import morphray
from scenes import assert_same_bits, grid, random_rays

# Jobs in the background of a script ignore it from the start.
signal.signal(signal.SIGINT, signal.default_int_handler)
points, triangles = grid(100)
slow = morphray.Scene(points, triangles, device=morphray.Device.brute_force(threads=1))
fast = morphray.Scene(points, triangles, device=morphray.Device.cpu(threads=1))
rays = random_rays(points, 300_000)
six = np.ascontiguousarray(rays[:, [0, 1, 2, 4, 5, 6]])
where = np.ascontiguousarray(rays[:, :3]) * np.float32(0.3)
calls = {
    "render": lambda: fast.render((4096, 4096), rays="ao", ao_count=256),
    "intersect six": lambda: slow.intersect(six),
    "signed_distance": lambda: slow.signed_distance(where),
}
many_points, many_triangles = grid(1500)
calls["build"] = lambda: morphray.Scene(many_points, many_triangles,
                                        device=morphray.Device.cpu(threads=1))

def interrupt_after(seconds):
    threading.Timer(seconds, lambda: os.kill(os.getpid(), signal.SIGINT)).start()

def expect_interrupt(call):
    try:
        call()
    except KeyboardInterrupt:
        return
    sys.exit("no KeyboardInterrupt")

def expect_usable():
    few = rays[:20]
    for scene in [slow, fast]:
        assert not morphray.compare(scene, fast, few)
        points[:, 2] += np.float32(0.01)
        scene.update()
        points[:, 2] -= np.float32(0.01)
        scene.update()
    assert_same_bits(slow.intersect(few), fast.intersect(few))
    image = fast.render((8, 8))
    assert image.image_hash == slow.render((8, 8)).image_hash
"""


def run(code):
    done = subprocess.run([sys.executable, "-c", PROGRAM + code], cwd=os.path.dirname(__file__),
                          capture_output=True, text=True, timeout=90)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.parametrize("name", ["render", "intersect six", "signed_distance", "build"])
def test_ctrl_c_ends_a_call_and_leaves_the_scene_usable(name):
    run(f"""
interrupt_after(0.3)
expect_interrupt(calls[{name!r}])
expect_usable()
""")


def test_a_handler_that_does_not_raise_cancels_the_call():
    run("""
signal.signal(signal.SIGINT, lambda number, frame: None)
interrupt_after(0.3)
try:
    calls["render"]()
except morphray.Error as error:
    assert error.code == "cancelled"
else:
    sys.exit("not cancelled")
expect_usable()
""")


def test_a_daemon_thread_may_be_at_work_when_the_program_ends():
    out = run("""
working = threading.Event()

def work():
    while True:
        working.set()
        fast.intersect(rays[:100_000])

threading.Thread(target=work, daemon=True).start()
working.wait()
time.sleep(0.1)
print("done")
""")
    assert out == "done\n"


def cancelled(work):
    with pytest.raises(morphray.Error, match="cancelled") as caught:
        work()
    assert caught.value.code == "cancelled"


def test_cancel_ends_calls_in_any_thread():
    """Each would take minutes."""
    points, triangles = grid(100)
    slow = morphray.Scene(points, triangles, device=morphray.Device.brute_force(threads=1))
    rays = random_rays(points, 100_000)
    for call in [
        lambda cancel: slow.render((4096, 4096), rays="ao", ao_count=256, cancel=cancel),
        lambda cancel: slow.intersect_all(rays, cancel=cancel),
        lambda cancel: slow.closest_points(rays[:, :3] * 0.3, cancel=cancel),
    ]:
        cancel = morphray.Cancel()
        assert not cancel.is_set()
        timer = threading.Timer(0.2, cancel.set)
        timer.start()
        cancelled(lambda: call(cancel))
        timer.join()
        assert cancel.is_set()
        cancelled(lambda: slow.count(rays[:0], cancel=cancel))
        cancel.clear()
        # Calls whose flag is clear, or that have none, go on.
        for other in (cancel, morphray.Cancel(), None):
            assert slow.count(rays[:10], cancel=other).shape == (10,)
