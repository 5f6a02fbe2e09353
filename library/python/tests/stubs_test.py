"""The stub file is that of the module, and types help callers."""

import subprocess
import sys


def test_stubtest_finds_nothing(tmp_path):
    check = [sys.executable, "-m", "mypy.stubtest", "morphray"]
    if subprocess.run(check + ["--help"], capture_output=True).returncode != 0:
        return  # there is no mypy
    done = subprocess.run(check, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


USE = """
import numpy as np
import morphray

points = np.zeros((3, 3), np.float32)
triangles = np.zeros((1, 3), np.uint32)
scene = morphray.Scene(points, triangles, device=morphray.Device.cpu(threads=1), update="refit",
                       bounds=((0, 0, 0), (1, 1, 1)))
several = morphray.Scene([(points, triangles), morphray.Mesh(points, triangles, deforms=False)])
step: str = scene.update().step
scene.update(0, 1, 2)
rays = np.zeros((1, 6), np.float32)
t = scene.cast_rays(rays)["t_hit"]
hits = scene.intersect(rays, out=np.empty(1, morphray.hit_dtype))
points_asked = np.zeros((2, 3), np.float32)
cancel = morphray.Cancel()
all_hits: morphray.AllHits = scene.intersect_all(rays, crossing="each", max_hits=3, cancel=cancel)
first_hits = all_hits.hits[all_hits.offsets[:-1]]
number: int = int(scene.count(rays)[0])
scene.winding(points_asked, cancel=cancel)
inside = scene.contains(points_asked, rule="odd")
closest = scene.closest_points(points_asked, 0.5, np.empty(2, morphray.closest_dtype))
distance: float = float(scene.signed_distance(points_asked)[0])
image = scene.render((4, 4), eye=(0, 0, 1), rays="ao", cancel=cancel)
ended: bool = cancel.is_set()
assert not morphray.compare(scene, scene.on("brute"), rays)
assert not morphray.compare(image, image)
"""


def test_type_checker_accepts_right_uses_and_rejects_wrong_ones(tmp_path):
    check = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "cache")]
    if subprocess.run(check + ["--version"], capture_output=True).returncode != 0:
        return  # there is no mypy
    (tmp_path / "right.py").write_text(USE)
    done = subprocess.run(check + [str(tmp_path / "right.py")], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
    wrong = ['scene.render((4, 4), rays="many")', "scene.render((4, 4), cancel=True)",
             "scene.updat()", 'scene.update("a")',
             "morphray.compare(scene, image, rays)", "morphray.Scene(points, triangles, 3)",
             'scene.contains(points_asked, rule="even")', "scene.count(rays, crossing=1)",
             "scene.winding(points_asked, inside)", "scene.intersect_all(rays, 3)"]
    (tmp_path / "wrong.py").write_text(USE + "\n".join(wrong) + "\n")
    done = subprocess.run(check + [str(tmp_path / "wrong.py")], capture_output=True, text=True)
    lines = {line.split(":")[1] for line in done.stdout.splitlines() if ": error:" in line}
    assert len(lines) == len(wrong), done.stdout
