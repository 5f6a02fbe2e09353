"""The build backend of pyproject.toml (PEP 517): CMake builds the package, and this packs it.

A wheel has the libraries in it that not every Linux has, under names of their own: otherwise the
loader would take another version that a process has loaded already, and lend ours to others. Its tag
names the oldest glibc with which it works (PEP 600).

It needs cmake, ninja, a C++20 compiler, the headers of Python and pybind11, and libraries that
cmake/packages.txt lists as "build". It takes these settings (pip's --config-settings):

    vulkan=OFF     build without Vulkan
    build-dir=DIR  build there instead of build/python
    jobs=N         compile N files at a time
"""

import base64
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import zipfile

from morphray_elf import SharedLibrary

ROOT = pathlib.Path(__file__).resolve().parent.parent
SETTINGS = {"vulkan", "build-dir", "jobs"}
# Every Linux of PEP 600 has these.
SYSTEM_LIBRARIES = {"libc.so.6", "libm.so.6", "libdl.so.2", "librt.so.1", "libpthread.so.0",
                    "libgcc_s.so.1", "libstdc++.so.6", "libz.so.1", "ld-linux-x86-64.so.2",
                    "ld-linux-aarch64.so.1"}
# A version of g++'s libraries and zlib, and the oldest glibc beside which each distribution has that
# version or a later one, as auditwheel's policies say.
GLIBC_BESIDE = {
    "GLIBCXX": [((3, 4, 28), (2, 31)), ((3, 4, 29), (2, 34)), ((3, 4, 30), (2, 35)),
                ((3, 4, 33), (2, 39))],
    "CXXABI": [((1, 3, 12), (2, 31)), ((1, 3, 13), (2, 34)), ((1, 3, 15), (2, 39))],
    "GCC": [((7, 0, 0), (2, 31)), ((11, 0), (2, 34)), ((12, 0, 0), (2, 35)), ((14, 0, 0), (2, 39))],
    "ZLIB": [((1, 2, 9), (2, 27)), ((1, 2, 12), (2, 37))],
}


def _version():
    text = (ROOT / "CMakeLists.txt").read_text()
    return re.search(r"project\(morphray VERSION ([0-9.]+)", text).group(1)


def _licences():
    """Those of the project and of all that a wheel has in it, as paths in the checkout."""
    return [ROOT / "LICENSE", *sorted((ROOT / "python/licenses").iterdir())]


def _metadata():
    licences = "\n".join(f"License-File: {file.relative_to(ROOT)}" for file in _licences())
    return f"""Metadata-Version: 2.4
Name: morphray
Version: {_version()}
Summary: A ray tracer for deforming triangle meshes with bit-exact results
License-Expression: MIT AND Apache-2.0 AND BSD-2-Clause AND BSD-3-Clause
{licences}
Classifier: Programming Language :: Python :: 3
Classifier: Programming Language :: C++
Classifier: Operating System :: POSIX :: Linux
Requires-Python: >=3.9
Requires-Dist: numpy
Description-Content-Type: text/markdown

{(ROOT / "docs/guide/python.md").read_text()}"""


def _needed_glibc(libraries):
    """The oldest glibc with which libraries work, or None if they need what this file does not know."""
    newest = (2, 17)
    for source, version in (need for library in libraries for need in library.versions):
        if source not in SYSTEM_LIBRARIES:
            continue
        kind, _, number = version.partition("_")
        parts = tuple(int(part) for part in number.split(".") if part.isdigit())
        if kind == "GLIBC":
            needed = parts[:2]
        else:
            known = GLIBC_BESIDE.get(kind, [])
            needed = next((glibc for last, glibc in known if parts and parts <= last), None)
        if not needed:
            return None
        newest = max(newest, needed)
    return newest


def _tag(libraries):
    python = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    platform = re.sub(r"[-.]", "_", sysconfig.get_platform())
    glibc = _needed_glibc(libraries)
    if glibc:
        platform = platform.replace("linux", f"manylinux_{glibc[0]}_{glibc[1]}", 1)
    return f"{python}-{python}-{platform}"


def _dist_info():
    return f"morphray-{_version()}.dist-info"


def _run(*command):
    print("+", *command, flush=True)
    try:
        subprocess.run(command, check=True)
    except FileNotFoundError:
        sys.exit(f"morphray: {command[0]} is not installed; cmake/packages.txt lists what is needed")
    except subprocess.CalledProcessError:
        sys.exit("morphray: the build failed; cmake/packages.txt lists the packages that it needs, "
                 "and pybind11-dev and python3-dev are two of them")


def _check(settings):
    unknown = set(settings) - SETTINGS
    if unknown:
        sys.exit(f"morphray: unknown settings: {', '.join(sorted(unknown))}; "
                 f"there are {', '.join(sorted(SETTINGS))}")


def _build(settings):
    """Returns the folder of the package."""
    _check(settings)
    build = pathlib.Path(settings.get("build-dir", ROOT / "build" / "python")).resolve()
    generator = ["-G", "Ninja"] if shutil.which("ninja") else []
    _run("cmake", "-S", str(ROOT), "-B", str(build), *generator,
         "-DCMAKE_BUILD_TYPE=Release", "-DMORPHRAY_PYTHON=ON", "-DMORPHRAY_TESTS=OFF",
         "-DMORPHRAY_PROGRAM=OFF", "-DMORPHRAY_INSTALL=OFF",
         f"-DMORPHRAY_VULKAN={settings.get('vulkan', 'ON')}",
         f"-DPython_EXECUTABLE={sys.executable}")
    jobs = settings.get("jobs") or str(os.cpu_count() or 1)
    _run("cmake", "--build", str(build), "--target", "morphray_python", "--parallel", jobs)
    return build / "python" / "morphray"


def _find_library(name, folders):
    for folder in folders:
        if (folder / name).exists():
            return folder / name
    sys.exit(f"morphray: the module needs {name}, which is in none of the folders that it was linked "
             f"from: {', '.join(map(str, folders))}")


def _own_name(name):
    """As long as before, so that it fits into the place of the other one."""
    stem = re.match(r"lib(.*?)[-.0-9]*\.so", name)
    if not stem or not (ROOT / f"python/licenses/{stem.group(1)}.txt").exists():
        sys.exit(f"morphray: the module needs {name}, whose licence is not in python/licenses")
    return f"mr-{name[3:]}"


def _with_libraries(module, folders):
    """The module and all libraries that it needs and not every Linux has, by name in the wheel. The
    loader finds them in the module's folder."""
    libraries = {module.name: SharedLibrary(module)}
    left = [module.name]
    while left:
        for name in libraries[left.pop()].needed:
            if name not in SYSTEM_LIBRARIES and name not in libraries:
                libraries[name] = SharedLibrary(_find_library(name, folders))
                left.append(name)
    names = {name: _own_name(name) for name in libraries if name != module.name}
    for library in libraries.values():
        library.rename(names)
    libraries[module.name].set_rpath("$ORIGIN")
    return {names.get(name, name): library for name, library in libraries.items()}


def _record_line(name, data):
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(data)}\n"


def _write_wheel(path, files):
    """Equal files make equal wheels: no times."""
    record = "".join(_record_line(name, data) for name, data in files.items())
    files = {**files, f"{_dist_info()}/RECORD": f"{record}{_dist_info()}/RECORD,,\n".encode()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            info = zipfile.ZipInfo(name)
            info.external_attr = 0o100644 << 16
            archive.writestr(info, data, zipfile.ZIP_DEFLATED)


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    _check(config_settings or {})
    folder = pathlib.Path(metadata_directory) / _dist_info()
    folder.mkdir()
    (folder / "METADATA").write_text(_metadata())
    return _dist_info()


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    package = _build(config_settings or {})
    folders = (package.parent / "library_folders.txt").read_text().splitlines()
    module = package / f"_morphray{sysconfig.get_config_var('EXT_SUFFIX')}"
    libraries = _with_libraries(module, [pathlib.Path(folder) for folder in folders])
    tag = _tag(libraries.values())
    info = _dist_info()
    files = {f"morphray/{name}": (package / name).read_bytes()
             for name in ("__init__.py", "__init__.pyi", "open3d.py", "open3d.pyi", "trimesh.py",
                          "trimesh.pyi", "py.typed")}
    files.update({f"morphray/{name}": bytes(library.data) for name, library in libraries.items()})
    files[f"{info}/METADATA"] = _metadata().encode()
    files[f"{info}/WHEEL"] = (f"Wheel-Version: 1.0\nGenerator: morphray_build\n"
                              f"Root-Is-Purelib: false\nTag: {tag}\n").encode()
    files.update({f"{info}/licenses/{licence.relative_to(ROOT)}": licence.read_bytes()
                  for licence in _licences()})
    wheel = f"morphray-{_version()}-{tag}.whl"
    _write_wheel(pathlib.Path(wheel_directory) / wheel, files)
    return wheel


def build_sdist(sdist_directory, config_settings=None):
    """Packs the files of the checkout that git has."""
    _check(config_settings or {})
    listed = subprocess.run(["git", "-C", str(ROOT), "ls-files", "-z"], check=True,
                            stdout=subprocess.PIPE).stdout.decode()
    name = f"morphray-{_version()}"
    with tempfile.TemporaryDirectory() as scratch:
        info = pathlib.Path(scratch) / "PKG-INFO"
        info.write_text(_metadata())
        with tarfile.open(pathlib.Path(sdist_directory) / f"{name}.tar.gz", "w:gz",
                          format=tarfile.PAX_FORMAT) as archive:
            archive.add(info, f"{name}/PKG-INFO")
            for file in filter(lambda name: name and (ROOT / name).exists(), listed.split("\0")):
                archive.add(ROOT / file, f"{name}/{file}", recursive=False)
    return f"{name}.tar.gz"
