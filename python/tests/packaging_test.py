"""The build backend packs what was built, offline."""

import base64
import hashlib
import importlib
import os
import pathlib
import re
import subprocess
import sys
import tarfile
import types
import zipfile

import pytest

import morphray

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture
def backend(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "python"))
    module = importlib.import_module("morphray_build")
    # The package that the tests run with, instead of one more build.
    package = pathlib.Path(morphray.__file__).parent
    monkeypatch.setattr(module, "_build", lambda settings: package)
    return module


def test_wheel_is_complete(backend, tmp_path):
    path = tmp_path / backend.build_wheel(tmp_path)
    wheel = zipfile.ZipFile(path)
    names = wheel.namelist()
    assert {"morphray/__init__.py", "morphray/__init__.pyi", "morphray/py.typed"} <= set(names)
    assert any(n.startswith("morphray/_morphray") and n.endswith(".so") for n in names)
    info = f"morphray-{morphray.__version__}.dist-info"
    lines = [line.split(",") for line in wheel.read(f"{info}/RECORD").decode().splitlines()]
    assert [line[0] for line in lines] == names
    for name, digest, size in lines[:-1]:
        data = wheel.read(name)
        own = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("=")
        assert (digest, int(size)) == (f"sha256={own}", len(data))
    tag = re.search("^Tag: (.*)$", wheel.read(f"{info}/WHEEL").decode(), re.M).group(1)
    assert path.name == f"morphray-{morphray.__version__}-{tag}.whl"
    metadata = wheel.read(f"{info}/METADATA").decode()
    assert f"Version: {morphray.__version__}\n" in metadata
    licences = re.findall("^License-File: (.*)$", metadata, re.M)
    assert {"LICENSE", "python/licenses/tbb.txt"} <= set(licences)
    assert {f"{info}/licenses/{name}" for name in licences} <= set(names)


def test_equal_files_make_equal_wheels(backend, tmp_path):
    first = (tmp_path / backend.build_wheel(tmp_path)).read_bytes()
    assert (tmp_path / backend.build_wheel(tmp_path)).read_bytes() == first


def readelf(option, path):
    return subprocess.run(["readelf", "--wide", option, str(path)], check=True, text=True,
                          stdout=subprocess.PIPE).stdout


def test_wheel_has_the_libraries_that_it_needs(backend, tmp_path):
    name = backend.build_wheel(tmp_path)
    zipfile.ZipFile(tmp_path / name).extractall(tmp_path)
    libraries = {file.name: file for file in (tmp_path / "morphray").glob("*.so*")}
    assert any(library.startswith("mr-tbb.so") for library in libraries)
    tagged = re.search(r"-manylinux_(\d+)_(\d+)_[a-z0-9_]+\.whl$", name)
    for library, file in libraries.items():
        dynamic = readelf("-d", file)
        needed = set(re.findall(r"\(NEEDED\).*\[(.*)\]", dynamic))
        assert needed - set(libraries) <= backend.SYSTEM_LIBRARIES
        paths = re.findall(r"\((?:RPATH|RUNPATH)\).*\[(.*)\]", dynamic)
        if library.startswith("mr-"):
            assert f"soname: [{library}]" in dynamic and not paths
        else:
            assert paths == ["$ORIGIN"]
        if tagged:
            versions = re.findall(r"Name: GLIBC_(\d+)\.(\d+)", readelf("-V", file))
            assert all(int(a) == 2 and int(b) <= int(tagged.group(2)) for a, b in versions)
    # The loader takes these, and none of the machine's; and hits are right.
    program = ("import check; check.check_libraries(); "
               "assert check.hashes('cpu') == check.EXPECTED, check.hashes('cpu')")
    variables = {key: value for key, value in os.environ.items() if key != "LD_LIBRARY_PATH"}
    used = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True,
                          env={**variables, "PYTHONPATH": f"{tmp_path}:{ROOT / 'cmake/wheel'}"})
    assert used.returncode == 0, used.stderr


@pytest.mark.parametrize("versions, glibc", [
    ([], (2, 17)),
    ([("libc.so.6", "GLIBC_2.2.5"), ("libc.so.6", "GLIBC_2.34")], (2, 34)),
    ([("libc.so.6", "GLIBC_2.34"), ("libstdc++.so.6", "GLIBCXX_3.4.30")], (2, 35)),
    ([("libstdc++.so.6", "GLIBCXX_3.4.32"), ("libstdc++.so.6", "CXXABI_1.3.15")], (2, 39)),
    ([("libstdc++.so.6", "GLIBCXX_3.4.99")], None),
    ([("libc.so.6", "GLIBC_PRIVATE")], None),
    ([("libz.so.1", "ZLIB_1.2.0"), ("mr-hwy.so.1", "HWY_0")], (2, 27)),
])
def test_glibc_of_a_tag(backend, versions, glibc):
    assert backend._needed_glibc([types.SimpleNamespace(versions=versions)]) == glibc


def test_libraries_that_cannot_be_packed_are_refused(backend, tmp_path):
    with pytest.raises(SystemExit, match="libnew.so.1, whose licence is not in python/licenses"):
        backend._own_name("libnew.so.1")
    with pytest.raises(SystemExit, match="libtbb.so.12, which is in none of the folders"):
        backend._find_library("libtbb.so.12", [tmp_path])
    (tmp_path / "text.so").write_text("no library")
    with pytest.raises(ValueError, match="text.so: not a library of a 64-bit"):
        backend.SharedLibrary(tmp_path / "text.so")


def test_metadata_needs_no_build(backend, tmp_path):
    info = backend.prepare_metadata_for_build_wheel(tmp_path)
    assert (tmp_path / info / "METADATA").read_text().startswith("Metadata-Version: 2.4\n")


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
            f"{root}/python/morphray_elf.py", f"{root}/python/licenses/tbb.txt",
            f"{root}/CMakeLists.txt"} <= set(archive.getnames())
