# make_wheels ARCHITECTURE LIBRARIES [VERSION...]: from a build that is set up, leaves a wheel for each VERSION of
# CPython, such as 3.13, in $build/wheels, and prints their paths; without VERSION, for that of /usr/bin/python3.
# LIBRARIES is the folder of the libraries that the build links. The headers come from packages of Debian's
# ARCHITECTURE, which have 3.9, 3.11, 3.13 and 3.14, and are unpacked into $build/headers, never installed. To be
# sourced by bash after cmake/setup.sh.

system_python_version() { /usr/bin/python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])'; }

# unpack_headers ARCHITECTURE VERSION: those of CPython, and those of a pybind11 that knows numpy 2 and this version.
unpack_headers() {
    local headers=$build/headers state=$build/headers.apt suite package
    [ ! -e "$headers/include/python$2/Python.h" ] || return 0
    say "fetching the headers of Python $2"
    mkdir -p "$state" "$headers"
    for suite in bullseye bookworm trixie sid; do
        echo "deb http://deb.debian.org/debian $suite main"
    done >"$state/sources.list"
    # One of the suites may have left the mirror.
    local own_apt=(apt_with_state "$state" "$1"
        -o Dir::Etc::SourceList="$state/sources.list" -o Dir::Etc::SourceParts=-
        -o APT::Default-Release=trixie)
    "${own_apt[@]}" update || true
    (cd "$state" && "${own_apt[@]}" download "libpython$2-dev" pybind11-dev) ||
        show_log_and_exit 4 "libpython$2-dev and pybind11-dev could not be fetched"
    for package in "$state"/*.deb; do
        dpkg-deb --fsys-tarfile "$package" | tar -x -C "$headers" --strip-components=2 ./usr/include
    done
    rm -rf "$state"
}

make_wheels() {
    local architecture=$1 libraries=$2 headers=$build/headers/include versions=("${@:3}") version
    [ ${#versions[@]} -gt 0 ] || versions=("$(system_python_version)")
    rm -rf "$build/wheels"
    mkdir "$build/wheels"
    for version in "${versions[@]}"; do
        unpack_headers "$architecture" "$version"
        { cmake -DMORPHRAY_PYTHON_HEADERS="$headers/python$version;$headers" "$build" &&
            ninja -C "$build" morphray_python; } >>"$log" 2>&1 ||
            show_log_and_exit 70 "the build for Python $version failed"
        python3 "$root/cmake/wheel/manylinux.py" "$version" "$build" "$libraries" "$build/wheels"
    done
}
