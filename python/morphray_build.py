"""The build backend of pyproject.toml (PEP 517): CMake builds the package, and this packs it.

It needs cmake, ninja, a C++20 compiler, the headers of Python and pybind11, and the libraries that
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

ROOT = pathlib.Path(__file__).resolve().parent.parent
SETTINGS = {"vulkan", "build-dir", "jobs"}


def _version():
    text = (ROOT / "CMakeLists.txt").read_text()
    return re.search(r"project\(morphray VERSION ([0-9.]+)", text).group(1)


def _metadata():
    return f"""Metadata-Version: 2.1
Name: morphray
Version: {_version()}
Summary: A ray tracer for deforming triangle meshes with bit-exact results
License: MIT
Classifier: Programming Language :: Python :: 3
Classifier: Programming Language :: C++
Classifier: Operating System :: POSIX :: Linux
Requires-Python: >=3.9
Requires-Dist: numpy
Description-Content-Type: text/markdown

{(ROOT / "docs/guide/python.md").read_text()}"""


def _tag():
    python = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    platform = re.sub(r"[-.]", "_", sysconfig.get_platform())
    return f"{python}-{python}-{platform}"


def _wheel_text():
    return f"Wheel-Version: 1.0\nGenerator: morphray_build\nRoot-Is-Purelib: false\nTag: {_tag()}\n"


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
         f"-DMORPHRAY_VULKAN={settings.get('vulkan', 'ON')}",
         f"-DPython_EXECUTABLE={sys.executable}",
         "-DCMAKE_INSTALL_PREFIX=/usr/local")
    jobs = settings.get("jobs") or str(os.cpu_count() or 1)
    _run("cmake", "--build", str(build), "--target", "morphray_python", "--parallel", jobs)
    return build / "python" / "morphray"


def _write_dist_info(folder):
    folder.mkdir(parents=True)
    (folder / "METADATA").write_text(_metadata())
    (folder / "WHEEL").write_text(_wheel_text())
    shutil.copy(ROOT / "LICENSE", folder / "LICENSE")


def _record_line(name, data):
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(data)}\n"


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    _check(config_settings or {})
    _write_dist_info(pathlib.Path(metadata_directory) / _dist_info())
    return _dist_info()


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    package = _build(config_settings or {})
    suffix = sysconfig.get_config_var("EXT_SUFFIX")
    files = {f"morphray/{name}": package / name
             for name in ("__init__.py", "__init__.pyi", "py.typed", f"_morphray{suffix}")}
    wheel = f"morphray-{_version()}-{_tag()}.whl"
    with tempfile.TemporaryDirectory() as scratch:
        info = pathlib.Path(scratch) / _dist_info()
        _write_dist_info(info)
        files.update({f"{_dist_info()}/{file.name}": file for file in sorted(info.iterdir())})
        record = ""
        with zipfile.ZipFile(pathlib.Path(wheel_directory) / wheel, "w",
                             zipfile.ZIP_DEFLATED) as archive:
            for name, file in files.items():
                archive.write(file, name)
                record += _record_line(name, file.read_bytes())
            archive.writestr(f"{_dist_info()}/RECORD", f"{record}{_dist_info()}/RECORD,,\n")
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
