"""The build backend packs what was built, offline."""

import base64
import hashlib
import importlib
import os
import pathlib
import re
import subprocess
import sys
import sysconfig
import zipfile

import pytest

import morphray

ROOT = pathlib.Path(__file__).resolve().parents[3]


@pytest.fixture
def backend(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "library/python"))
    module = importlib.import_module("morphray_build")
    # The package that the tests run with, instead of one more build.
    package = pathlib.Path(morphray.__file__).parent
    monkeypatch.setattr(module, "_build", lambda settings: package)
    return module


def check_record(wheel):
    record = wheel.read(f"morphray-{morphray.__version__}.dist-info/RECORD").decode()
    lines = [line.split(",") for line in record.splitlines()]
    assert [line[0] for line in lines] == wheel.namelist()
    for name, digest, size in lines[:-1]:
        data = wheel.read(name)
        own = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("=")
        assert (digest, int(size)) == (f"sha256={own}", len(data))


def test_wheel_is_complete(backend, tmp_path):
    path = tmp_path / backend.build_wheel(tmp_path)
    wheel = zipfile.ZipFile(path)
    names = wheel.namelist()
    assert {"morphray/__init__.py", "morphray/open3d.py", "morphray/py.typed"} <= set(names)
    assert any(n.startswith("morphray/_morphray") and n.endswith(".so") for n in names)
    info = f"morphray-{morphray.__version__}.dist-info"
    check_record(wheel)
    tag = re.search("^Tag: (.*)$", wheel.read(f"{info}/WHEEL").decode(), re.M).group(1)
    assert path.name == f"morphray-{morphray.__version__}-{tag}.whl"
    metadata = wheel.read(f"{info}/METADATA").decode()
    assert f"Version: {morphray.__version__}\n" in metadata
    assert "Requires-Dist: numpy\n" in metadata
    assert f"{info}/LICENSE" in names
    # The module that was packed traces.
    wheel.extractall(tmp_path)
    trace = "import morphray; print(morphray.__file__); morphray.Scene([])"
    used = subprocess.run([sys.executable, "-c", trace], cwd=tmp_path, check=True, text=True,
                          stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(tmp_path)})
    assert used.stdout.startswith(str(tmp_path))


def test_module_prints_the_documented_digest_of_each_device():
    result = subprocess.run([sys.executable, "-m", "morphray.digest"], check=True, text=True,
                            stdout=subprocess.PIPE)
    *lines, _, verdict = result.stdout.splitlines()
    assert len(lines) > len(morphray.simd_targets())
    assert {int(line[:16], 16) for line in lines} == {morphray.DIGEST}
    assert verdict.startswith("equal")


def output(*command):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


def test_wheel_for_other_machines(monkeypatch, tmp_path):
    build = pathlib.Path(morphray.__file__).parents[2]
    if not (build / "bin/morphray").exists():
        return  # the package was not built by CMake's preset
    monkeypatch.syspath_prepend(str(ROOT / "cmake/wheel"))
    version = "{}.{}".format(*sys.version_info)
    libraries = "/usr/lib/" + sysconfig.get_config_var("MULTIARCH")
    path = importlib.import_module("manylinux").make_wheel(version, build, libraries, tmp_path)
    assert path.stat().st_size < 11e6
    wheel = zipfile.ZipFile(path)
    check_record(wheel)
    wheel.extractall(tmp_path)
    executables = ["morphray/bin/morphray", f"morphray-{morphray.__version__}.data/scripts/morphray"]
    for name in executables:
        assert wheel.getinfo(name).external_attr >> 16 & 0o777 == 0o755
        (tmp_path / name).chmod(0o755)
    program, launcher = [tmp_path / name for name in executables]
    own = list((tmp_path / "morphray.libs").iterdir())
    files = [*(tmp_path / "morphray").glob("*.so"), program, *own]
    assert len(files) > 10
    glibc = 0
    for file in files:
        # objdump lists the symbols, and manylinux.py reads the versions of libraries.
        symbols = output("objdump", "--dynamic-syms", file)
        glibc = max([glibc, *map(int, re.findall(r"\(GLIBC_2\.(\d+)[.)]", symbols))])
        if re.search(r"GLIBCXX_3\.4\.3[12]\b", symbols):  # of Debian 13
            glibc = max(glibc, 38)
        assert "GLIBCXX_3.4.33" not in symbols
        for name in re.findall(r"NEEDED +(\S+)", output("objdump", "--private-headers", file)):
            system = re.match(r"(libc|libm|libgcc_s|libstdc\+\+|libdl|libpthread|ld-linux.*)\.so\.", name)
            assert system or name in {library.name for library in own}, file
    # libstdc++ of g++ 12 comes with glibc 2.35.
    tag = int(re.search(r"manylinux_2_(\d+)_", path.name).group(1))
    assert glibc <= tag <= max(glibc, 35)
    licences = [name for name in wheel.namelist() if "/licenses/" in name]
    assert len(licences) > 5 and all(wheel.read(name) for name in licences)
    # Neither file takes a library of the system for one of its own.
    trace = ("import morphray, pathlib; morphray.Scene([]);"
             "print(pathlib.Path('/proc/self/maps').read_text())")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    mapped_files = output(sys.executable, "-c", trace)
    for library in ("libtbb", "libgmp", "libfmt", "libhwy", "libxxhash"):
        mapped = set(re.findall(rf"\S*/{library}\S*", mapped_files))
        assert [str(tmp_path / "morphray.libs") in name for name in mapped] == [True], mapped
    resolved = output("ldd", program)
    assert f"{tmp_path}/morphray/bin/../../morphray.libs/libtbb" in resolved
    assert "not found" not in resolved
    assert "builtin:cloth" in output(sys.executable, launcher, "info")


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
    assert {"__init__.py", "_morphray.pyi", "_views.py", "digest.py", "open3d.py", "py.typed", "trimesh.py"} < files
    assert len(files) == 8
    trace = ("import numpy, morphray; print(morphray.__file__); "
             "morphray.Scene([]).intersect(numpy.zeros((1, 6), numpy.float32))")
    used = subprocess.run([sys.executable, "-c", trace], cwd=tmp_path, check=True, text=True,
                          stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(folder)})
    assert used.stdout.startswith(str(folder))
