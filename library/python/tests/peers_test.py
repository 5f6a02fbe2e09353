"""library/python/tests/peers/run, on small stand-ins for Open3D, trimesh and their tests."""

import os
import pathlib
import subprocess
import sys

import pytest

import morphray

RUN = pathlib.Path(__file__).with_name("peers") / "run"
PACKAGE = pathlib.Path(morphray.__file__).resolve().parents[1]

# The parts of the two libraries that the substitution touches.
FILES = {
    "modules/open3d.py": """
import types
class Tensor:
    def __init__(self, array): self.array = array
    from_numpy = classmethod(lambda cls, array: cls(array))
    numpy = lambda self: self.array
core = types.SimpleNamespace(Tensor=Tensor)
t = types.SimpleNamespace(geometry=types.SimpleNamespace(RaycastingScene=None))
""",
    "modules/scipy.py": "", "modules/rtree.py": "", "modules/networkx.py": "", "modules/shapely.py": "",
    "peers/trimesh/trimesh/__init__.py": "from . import boolean, proximity, ray",
    "peers/trimesh/trimesh/boolean.py": "difference = None",
    "peers/trimesh/trimesh/proximity.py": "ProximityQuery = closest_point = signed_distance = None",
    "peers/trimesh/trimesh/ray/__init__.py": "from . import ray_triangle, ray_pyembree",
    "peers/trimesh/trimesh/ray/ray_triangle.py": "RayMeshIntersector = 'its own'",
    "peers/open3d/python/test/t/geometry/test_raycasting_scene.py": """
import numpy as np
import open3d as o3d
def test_scene():
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.uint32))
    rays = o3d.core.Tensor(np.array([[0, 0, 0, 1, 1, 1]], np.float32))
    assert isinstance(scene.count_intersections(rays), o3d.core.Tensor)
    assert scene.list_intersections(rays)["ray_ids"].numpy().tolist() == [0]
    assert o3d.core.sycl.get_available_devices() == []
""",
    "peers/trimesh/tests/test_ray.py": """
import embreex, trimesh
def test_engines():
    for engine in [trimesh.ray.ray_pyembree, trimesh.ray.ray_triangle]:
        assert engine.RayMeshIntersector.__module__ == "morphray.trimesh"
    assert trimesh.ray.has_embree and embreex.__version__
""",
    "peers/trimesh/tests/test_ray_upstream.py": """
import trimesh
def test_issue_1919_engines_agree_simple_mesh():
    assert trimesh.ray.ray_triangle.RayMeshIntersector == 'its own'
""",
    "peers/trimesh/tests/test_proximity.py": """
import trimesh
def test_queries():
    for name in ["ProximityQuery", "closest_point", "signed_distance"]:
        assert getattr(trimesh.proximity, name).__module__ == "morphray.trimesh"
""",
}


@pytest.fixture
def peers(tmp_path):
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path / "peers"


def run(folder, *arguments):
    path = f"{folder.parent / 'modules'}:{PACKAGE}"
    done = subprocess.run([RUN, folder, *arguments], capture_output=True, text=True, timeout=120,
                          env={**os.environ, "PYTHON": sys.executable, "PYTHONPATH": path})
    return done.returncode, done.stdout + done.stderr


def test_the_classes_of_both_libraries_are_replaced(peers):
    status, output = run(peers)
    assert status == 0, output
    assert "passed     test_raycasting_scene.py::test_scene\n" in output
    assert "4 passed, 0 explained, 0 failed, 0 skipped" in output


@pytest.mark.parametrize("body, outcome", [
    ("assert False", "failed"), ("import pytest; pytest.skip('no')", "skipped")])
def test_what_does_not_pass_is_in_the_table(peers, body, outcome):
    (peers / "trimesh/tests/test_proximity.py").write_text(f"def test_queries(): {body}")
    status, output = run(peers)
    assert status == 1 and f"{outcome:9}  test_proximity.py::test_queries\n" in output, output


def test_what_has_an_explanation_is_no_failure(peers):
    (peers / "trimesh/tests/test_proximity.py").write_text("def test_queries(): assert False")
    (peers.parent / "modules/explain.py").write_text(
        "import substitutes\n"
        "substitutes.EXPLAINED['test_proximity.py::test_queries'] = 'Ours is right.'\n")
    status, output = run(peers, "-p", "explain")
    assert status == 0, output
    assert "explained  test_proximity.py::test_queries\n           Ours is right.\n" in output
    assert "3 passed, 1 explained, 0 failed, 0 skipped" in output


def test_files_that_cannot_be_read_are_failures(peers):
    (peers / "trimesh/tests/test_proximity.py").write_text("import no_such_module")
    status, output = run(peers)
    assert status != 0 and "failed     test_proximity.py\n" in output, output


@pytest.mark.parametrize("missing, message", [
    ("peers/trimesh/tests/test_ray.py", "no tests/test_ray.py below it"),
    ("modules/rtree.py", "needs numpy, pytest, open3d, scipy, rtree, networkx, shapely")])
def test_what_is_missing_is_named(peers, missing, message):
    (peers.parent / missing).unlink()
    if missing.endswith("rtree.py"):
        (peers.parent / missing).write_text("raise ImportError")
    status, output = run(peers)
    assert status == 2 and message in output, output
    assert run(peers / "nowhere")[0] == 2
