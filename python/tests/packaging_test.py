"""The build backend packs what was built, offline."""

import importlib.util
import os
import pathlib
import subprocess
import sys
import tarfile
import zipfile

import pytest

import morphray

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture
def backend(monkeypatch):
    spec = importlib.util.spec_from_file_location("backend", ROOT / "python/morphray_build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    # The package that the tests run with, instead of one more build.
    package = pathlib.Path(morphray.__file__).parent
    monkeypatch.setattr(module, "_build", lambda settings: package)
    return module


def test_wheel_is_complete(backend, tmp_path):
    wheel = zipfile.ZipFile(tmp_path / backend.build_wheel(tmp_path))
    names = wheel.namelist()
    assert {"morphray/__init__.py", "morphray/__init__.pyi", "morphray/py.typed"} <= set(names)
    assert any(n.startswith("morphray/_morphray") and n.endswith(".so") for n in names)
    info = f"morphray-{morphray.__version__}.dist-info"
    record = wheel.read(f"{info}/RECORD").decode().splitlines()
    assert [line.split(",")[0] for line in record] == names
    assert f"Version: {morphray.__version__}\n" in wheel.read(f"{info}/METADATA").decode()


def test_metadata_needs_no_build(backend, tmp_path):
    info = backend.prepare_metadata_for_build_wheel(tmp_path)
    assert (tmp_path / info / "METADATA").read_text().startswith("Metadata-Version: 2.1\n")


def cmake(*arguments):
    return subprocess.run(["cmake", *arguments], capture_output=True, text=True)


def test_component_python_is_installed_whole(tmp_path):
    build = pathlib.Path(morphray.__file__).parents[2]
    if not (build / "cmake_install.cmake").exists():
        return  # the package was not built by CMake's preset
    done = cmake("--install", str(build), "--component", "python", "--prefix", str(tmp_path))
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "lib" / "python3" / "dist-packages"
    files = {f.name for f in (folder / "morphray").iterdir()}
    assert {"__init__.py", "__init__.pyi", "open3d.py", "open3d.pyi", "py.typed", "trimesh.py",
            "trimesh.pyi"} < files
    assert len(files) == 8
    trace = ("import numpy, morphray; print(morphray.__file__); "
             "morphray.Scene([]).intersect(numpy.zeros((1, 6), numpy.float32))")
    used = subprocess.run([sys.executable, "-c", trace], cwd=tmp_path, check=True, text=True,
                          stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(folder)})
    assert used.stdout.startswith(str(folder))


def test_component_python_of_a_build_without_it_is_an_error(tmp_path):
    done = cmake("-S", str(ROOT), "-B", str(tmp_path / "build"), "-G", "Ninja",
                 "-DMORPHRAY_PYTHON=OFF",
                 "-DMORPHRAY_TESTS=OFF", "-DMORPHRAY_VULKAN=OFF", "-DMORPHRAY_PROGRAM=OFF")
    assert done.returncode == 0, done.stderr
    done = cmake("--install", str(tmp_path / "build"), "--component", "python", "--prefix",
                 str(tmp_path / "prefix"))
    assert done.returncode != 0
    # CMake breaks lines.
    message = " ".join(done.stderr.split())
    assert "This build has no Python package. Configure with -DMORPHRAY_PYTHON=ON" in message
    assert not (tmp_path / "prefix").exists()


def test_unknown_settings_are_refused(backend, tmp_path):
    with pytest.raises(SystemExit, match="unknown settings: vulkn"):
        backend.prepare_metadata_for_build_wheel(tmp_path, {"vulkn": "OFF"})


def test_source_archive_has_the_backend(backend, tmp_path):
    if not (ROOT / ".git").exists():
        return  # this is such an archive
    archive = tarfile.open(tmp_path / backend.build_sdist(tmp_path))
    root = f"morphray-{morphray.__version__}"
    assert {f"{root}/PKG-INFO", f"{root}/pyproject.toml", f"{root}/python/morphray_build.py",
            f"{root}/CMakeLists.txt"} <= set(archive.getnames())
