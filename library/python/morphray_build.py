"""The build backend of pyproject.toml (PEP 517): CMake builds the package, and this packs it.

The wheel is for machines like the one that made it; cmake/wheel/run makes wheels for others. Building
needs cmake, a C++20 compiler, the headers of Python and pybind11, and the libraries that
cmake/packages.txt lists as "build". Setting (pip's --config-settings): vulkan=OFF builds without Vulkan.
"""

import base64
import hashlib
import os
import pathlib
import re
import shutil
import stat
import subprocess
import sys
import sysconfig
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
VERSION = re.search(r"project\(morphray VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
NAME = f"morphray-{VERSION}"
METADATA = f"""Metadata-Version: 2.1
Name: morphray
Version: {VERSION}
Summary: A ray tracer for deforming triangle meshes with bit-exact results
License: MIT
Requires-Python: >=3.9
Requires-Dist: numpy
Description-Content-Type: text/markdown

{(ROOT / "docs/guide/python.md").read_text()}"""


def _run(*command):
    print("+", *command, flush=True)
    try:
        subprocess.run(command, check=True)
    except (FileNotFoundError, subprocess.CalledProcessError):
        sys.exit("morphray: the build failed; cmake/packages.txt lists the packages that it needs, "
                 "and pybind11-dev and python3-dev are two of them")


def _build(settings):
    """Returns the folder of the package."""
    build = ROOT / "build" / "python"
    generator = ["-G", "Ninja"] if shutil.which("ninja") else []
    _run("cmake", "-S", str(ROOT), "-B", str(build), *generator,
         "-DCMAKE_BUILD_TYPE=Release", "-DMORPHRAY_PYTHON=ON", "-DMORPHRAY_TESTS=OFF",
         "-DMORPHRAY_PROGRAM=OFF", "-DMORPHRAY_INSTALL=OFF",
         f"-DMORPHRAY_VULKAN={settings.get('vulkan', 'ON')}",
         f"-DPython_EXECUTABLE={sys.executable}")
    _run("cmake", "--build", str(build), "--target", "morphray_python", "--parallel",
         str(os.cpu_count() or 1))
    return build / "python" / "morphray"


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    package = _build(config_settings or {})
    module = f"_morphray{sysconfig.get_config_var('EXT_SUFFIX')}"
    python = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    tag = f"{python}-{python}-{re.sub('[-.]', '_', sysconfig.get_platform())}"
    return pack(wheel_directory, tag, {f"morphray/{module}": package / module})


def pack(wheel_directory, tag, paths):
    """Writes a wheel of the Python files and of `paths`, which maps names in the wheel to files.

    Returns the name of the wheel. Equal files give equal wheels.
    """
    python_files = (path for path in (ROOT / "library/python/morphray").iterdir()
                    if path.suffix in (".py", ".pyi", ".typed"))
    info = f"{NAME}.dist-info"
    paths = {**{f"morphray/{path.name}": path for path in sorted(python_files)}, **paths,
             f"{info}/LICENSE": ROOT / "LICENSE"}
    files = {name: path.read_bytes() for name, path in paths.items()}
    files[f"{info}/METADATA"] = METADATA.encode()
    files[f"{info}/WHEEL"] = (f"Wheel-Version: 1.0\nGenerator: morphray_build\n"
                              f"Root-Is-Purelib: false\nTag: {tag}\n").encode()
    record = ""
    for name, data in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(data)}\n"
    files[f"{info}/RECORD"] = f"{record}{info}/RECORD,,\n".encode()
    wheel = f"{NAME}-{tag}.whl"
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / wheel, "w") as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name)
            mode = 0o755 if re.search("/(bin|scripts)/", name) else 0o644
            entry.external_attr = (stat.S_IFREG | mode) << 16
            archive.writestr(entry, data, zipfile.ZIP_DEFLATED)
    return wheel
