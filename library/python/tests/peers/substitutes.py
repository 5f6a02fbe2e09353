"""A plugin of pytest: the tests of Open3D and trimesh get morphray's classes in place of theirs."""

import importlib.util
import os
import sys
import types

import numpy as np
import pytest

import morphray.open3d
import morphray.trimesh

# By name, as the table has them: why tests do not pass whose answer is wrong, where ours is right.
EXPLAINED = {}
# Compares two engines: ours with trimesh's own.
BOTH_ENGINES = "test_issue_1919_engines_agree_simple_mesh"


def substitute_open3d():
    import open3d as o3d

    def tensors(result):
        if isinstance(result, dict):
            return {key: tensors(value) for key, value in result.items()}
        return o3d.core.Tensor.from_numpy(np.ascontiguousarray(result))

    class TensorScene(morphray.open3d.RaycastingScene):
        """Answers with tensors, which the tests take apart."""

    def with_tensors(name):
        method = getattr(morphray.open3d.RaycastingScene, name)
        return lambda self, *args, **kwargs: tensors(method(self, *args, **kwargs))

    for name in vars(morphray.open3d.RaycastingScene):
        if name.startswith(("cast_", "test_", "count_", "list_", "compute_")):
            setattr(TensorScene, name, with_tensors(name))
    o3d.t.geometry.RaycastingScene = TensorScene
    if not hasattr(o3d.core, "sycl"):
        # Releases before 0.19 have no such devices.
        o3d.core.sycl = types.SimpleNamespace(get_available_devices=lambda: [])


def substitute_trimesh():
    sys.path.insert(0, os.environ["MORPHRAY_PEERS_TRIMESH"])
    engine = types.ModuleType("trimesh.ray.ray_pyembree")
    engine.RayMeshIntersector = morphray.trimesh.RayMeshIntersector
    sys.modules[engine.__name__] = engine
    # A test begins with asking for its version.
    embree = types.ModuleType("embreex")
    embree.__version__ = "4.4.0"
    sys.modules[embree.__name__] = embree
    import trimesh

    trimesh.ray.ray_pyembree, trimesh.ray.has_embree = engine, True
    for name in ("ProximityQuery", "closest_point", "signed_distance"):
        setattr(trimesh.proximity, name, getattr(morphray.trimesh, name))
    if importlib.util.find_spec("manifold3d") is None:
        trimesh.boolean.difference = difference_of_nested


def difference_of_nested(meshes, **_):
    """Takes meshes from one that they lie inside of, for which no library is needed."""
    import trimesh

    outer, *inner = meshes
    for mesh in inner:
        if not (np.all(outer.bounds[0] < mesh.bounds[0]) and
                np.all(mesh.bounds[1] < outer.bounds[1])):
            raise NotImplementedError("manifold3d is needed for meshes that are not nested")
        mesh.invert()
    return trimesh.util.concatenate([outer, *inner])


class Table:
    """The outcome of each test."""

    def __init__(self):
        self.rows = {}

    def add(self, test, outcome, explanation=""):
        if self.rows.get(test, ("passed",))[0] == "passed":
            self.rows[test] = (outcome, explanation)

    def is_clean(self):
        return bool(self.rows) and all(row[0] in ("passed", "explained") for row in
                                       self.rows.values())

    def text(self):
        lines = [f"{outcome:9}  {test}" + (f"\n           {explanation}" if explanation else "")
                 for test, (outcome, explanation) in self.rows.items()]
        outcomes = [row[0] for row in self.rows.values()]
        counts = [f"{outcomes.count(outcome)} {outcome}"
                  for outcome in ("passed", "explained", "failed", "skipped")]
        return "\n".join(lines + [", ".join(counts)])


TABLE = Table()


def test_name(nodeid):
    return nodeid.rsplit("/", 1)[-1]


def pytest_configure(config):
    substitute_open3d()
    substitute_trimesh()


@pytest.fixture(autouse=True)
def substituted_engine(request, monkeypatch):
    import trimesh

    if request.node.name != BOTH_ENGINES:
        monkeypatch.setattr(trimesh.ray.ray_triangle, "RayMeshIntersector",
                            morphray.trimesh.RayMeshIntersector)


def pytest_runtest_logreport(report):
    test = test_name(report.nodeid)
    if report.failed and test in EXPLAINED:
        TABLE.add(test, "explained", EXPLAINED[test])
    elif report.when == "call" or not report.passed:
        TABLE.add(test, report.outcome)


def pytest_collectreport(report):
    if not report.passed:
        TABLE.add(test_name(report.nodeid), report.outcome)


def pytest_terminal_summary(terminalreporter):
    terminalreporter.write_line(TABLE.text())


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session):
    if session.exitstatus in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED):
        session.exitstatus = 0 if TABLE.is_clean() else 1
