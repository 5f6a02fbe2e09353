"""manylinux.py VERSION BUILD LIBRARIES FOLDER: packs what CMake built as a wheel for other machines.

The wheel holds the extension module for CPython VERSION (3.13) and the program, both from BUILD, and the
libraries that they need from LIBRARIES (/usr/lib/x86_64-linux-gnu), under names that no other library of
the process has. glibc and the libraries of the compiler are the system's, and the tag names the oldest
glibc that suffices. Writes into FOLDER and prints the path of the wheel.
"""

import hashlib
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "library/python"))
import morphray_build  # noqa: E402

SYSTEM = re.compile(r"lib(c|m|dl|rt|pthread|gcc_s|stdc\+\+)\.so\.\d+|ld-linux-.*")
# (N, M): distributions with glibc 2.M have a libstdc++ with GLIBCXX_3.4.N (the policies of PEP 600).
GLIBC_OF_LIBSTDCXX = [(28, 31), (29, 34), (30, 35), (32, 38), (33, 39)]


def _output(*command):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


def _needed(path):
    names = re.findall(r"\(NEEDED\).*\[(.+)\]", _output("readelf", "--dynamic", path))
    return [name for name in names if not SYSTEM.fullmatch(name)]


def _copy_libraries(files, libraries, folder):
    """Copies all libraries that `files` need, and lets each file find them. Maps copies to originals."""
    folder.mkdir()
    names, originals, pending = {}, {}, list(files)
    for path in pending:
        for name in [name for name in _needed(path) if name not in names]:
            data = (libraries / name).read_bytes()
            stem, end = name.split(".so", 1)
            names[name] = f"{stem}-{hashlib.sha256(data).hexdigest()[:8]}.so{end}"
            pending.append(folder / names[name])
            pending[-1].write_bytes(data)
            originals[pending[-1]] = (libraries / name).resolve()
    for path in pending:
        # One change a call: patchelf 0.14 writes the strings of several over each other.
        for name in _needed(path):
            _output("patchelf", "--replace-needed", name, names[name], path)
        if path in originals:
            _output("patchelf", "--set-soname", path.name, path)
        _output("patchelf", "--set-rpath", f"$ORIGIN/{os.path.relpath(folder, path.parent)}", path)
    return originals


def _oldest_glibc(files):
    """The minor version of the oldest glibc with which these files can be used."""
    versions = _output("readelf", "--version-info", *files)
    glibc = max(int(minor) for minor in re.findall(r"Name: GLIBC_2\.(\d+)", versions))
    libstdcxx = max(int(minor) for minor in re.findall(r"Name: GLIBCXX_3\.4\.(\d+)", versions))
    return max(glibc, next(m for n, m in GLIBC_OF_LIBSTDCXX if libstdcxx <= n))


def make_wheel(version, build, libraries, folder):
    """Returns the path of the wheel. Arguments are those of the command line, as text."""
    build, libraries = pathlib.Path(build), pathlib.Path(libraries)
    python = f"cp{version.replace('.', '')}"
    with tempfile.TemporaryDirectory() as scratch:
        package = pathlib.Path(scratch) / "morphray"
        (package / "bin").mkdir(parents=True)
        files = [package / f"_morphray.cpython-{python[2:]}-{libraries.name}.so", package / "bin/morphray"]
        module, = (build / "python/morphray").glob("_morphray*.so")
        for built, stripped in zip((module, build / "bin/morphray"), files):
            _output(f"{libraries.name}-strip", built, "-o", stripped)
        originals = _copy_libraries(files, libraries, package.with_name("morphray.libs"))
        files += originals
        paths = {str(path.relative_to(scratch)): path for path in files}
        paths["morphray/share/morphray/plot.py"] = ROOT / "report/plot.py"
        paths[f"{morphray_build.NAME}.data/scripts/morphray"] = ROOT / "cmake/wheel/morphray"
        for original in originals.values():
            owner = _output("dpkg-query", "--search", f"*/{original.name}").split(":")[0]
            paths[f"{morphray_build.NAME}.dist-info/licenses/{owner}"] = (
                libraries.parents[1] / "share/doc" / owner / "copyright")
        tag = f"{python}-{python}-manylinux_2_{_oldest_glibc(files)}_{libraries.name.split('-')[0]}"
        return pathlib.Path(folder) / morphray_build.pack(folder, tag, paths)


if __name__ == "__main__":
    print(make_wheel(*sys.argv[1:]))
