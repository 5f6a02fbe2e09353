"""The stub file has the names, and the parameters, of the module; and nothing else."""

import ast
import inspect
import pathlib
import subprocess
import sys
import types

import pytest

import morphray

FOLDER = pathlib.Path(morphray.__file__).parent
STUB = ast.parse((FOLDER / "__init__.pyi").read_text())


def is_public(name):
    return not name.startswith("_") or name in ("__version__", "__bool__")


def stub_names(body):
    names = set()
    for node in body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            names.add(node.name)
        elif isinstance(node, ast.AnnAssign):
            names.add(node.target.id)
    return {name for name in names if is_public(name)}


def stub_classes():
    return [n for n in STUB.body if isinstance(n, ast.ClassDef) and is_public(n.name)]


def functions(body, owner):
    for node in body:
        if not isinstance(node, ast.FunctionDef) or not hasattr(owner, node.name):
            continue
        is_property = any(getattr(d, "id", "") == "property" for d in node.decorator_list)
        if not is_property and not node.name == "__bool__":
            yield node, getattr(owner, node.name)


def test_module_has_the_names_of_the_stub():
    public = set(morphray.__all__)
    assert stub_names(STUB.body) == public
    named = {
        n for n, v in vars(morphray).items()
        if is_public(n) and not isinstance(v, types.ModuleType)
    }
    assert named == public


@pytest.mark.parametrize("node", stub_classes(), ids=lambda node: node.name)
def test_classes_have_the_members_of_the_stub(node):
    cls = getattr(morphray, node.name)
    members = {n for n in vars(cls) if is_public(n)}
    if node.name == "Mesh":
        members = set(cls._fields)
    if node.name == "Error":
        members = {"code"}
    assert stub_names(node.body) == members


def test_functions_have_the_parameters_of_the_stub():
    pairs = list(functions(STUB.body, morphray))
    for node in stub_classes():
        pairs += functions(node.body, getattr(morphray, node.name))
    assert len(pairs) > 20
    for node, function in pairs:
        signature = inspect.signature(function)
        arguments = node.args
        expected = [a.arg for a in arguments.posonlyargs + arguments.args + arguments.kwonlyargs]
        assert list(signature.parameters) == expected, node.name
        # An overload in the stub may give fewer defaults.
        keyword_only = {
            p.name for p in signature.parameters.values() if p.kind is p.KEYWORD_ONLY
        }
        assert keyword_only == {a.arg for a in arguments.kwonlyargs}, node.name


def test_stubtest_finds_nothing(tmp_path):
    """It compares the stub with the module as mypy understands both."""
    check = [sys.executable, "-m", "mypy.stubtest", "morphray"]
    if subprocess.run(check + ["--help"], capture_output=True).returncode != 0:
        # Without mypy, the tests above remain.
        return
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
        # Without mypy, the tests above remain.
        return
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
