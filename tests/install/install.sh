#!/usr/bin/env bash
# install.sh ROOT SCRATCH CMAKE CXX BUILD: installs BUILD, moves it elsewhere, and builds and runs
# the examples against it: all with CMake's package, one with pkg-config. Nothing that is installed may name the folder that it was installed to, or BUILD.
set -euo pipefail
root=$1 scratch=$2 cmake=$3 cxx=$4 build=$5
first=$scratch/first prefix=$scratch/moved/here
fail() { echo "install: $*" >&2; exit 1; }
# CMakeLists.txt alone has it; what users see has to agree.
version=$(sed -n 's/^project(morphray VERSION \([0-9.]*\) .*/\1/p' "$root/CMakeLists.txt")
major=${version%%.*} minor=${version#*.}
minor=${minor%%.*}
series=$major.$minor later=$major.$((minor + 1))

rm -rf "$first" "$scratch/moved"
for component in library dev program; do
    "$cmake" --install "$build" --prefix "$first" --component $component >/dev/null
done
mkdir -p "$scratch/moved"
mv "$first" "$prefix"

# check_paths: nothing that is installed names a folder of this machine, so that the same sources make the same
# bytes wherever they are built. With assertions, programs and libraries name their sources.
binary_files=(--binary-files=without-match)
! grep -qx 'CMAKE_BUILD_TYPE:[A-Z]*=Release' "$build/CMakeCache.txt" || binary_files=()
check_paths() {
    if grep -rlF "${binary_files[@]}" -e "$first" -e "$build" -e "$root" "$prefix"; then
        fail "these files name a folder of this machine"
    fi
}
check_paths
for file in bin/morphray include/morphray/morphray.hpp include/morphray/version.hpp \
    share/doc/morphray/LICENSE share/morphray/plot.py share/morphray/scenes/robot.gltf \
    share/morphray/scenes/flag/flag_3.obj; do
    [ -e "$prefix/$file" ] || fail "$file is not installed"
done
# The build has no libraries in place of Embree's without its headers.
if [ -e "$build/bin/morphray-embree" ]; then
    rm -rf "$scratch/embree"
    DESTDIR=$scratch/embree "$cmake" --install "$build" --prefix /usr --component embree >/dev/null
    [ -e "$scratch/embree/usr/bin/morphray-embree" ] || fail "bin/morphray-embree is not installed"
fi
library=$(dirname "$(find "$prefix" -name libmorphray.so)")
[ "$(readlink "$library/libmorphray.so")" = "libmorphray.so.$major" ] || fail "no link to the soname"
[[ $("$prefix/bin/morphray" --version) == "morphray $version"* ]] || fail "the program is not $version"
for file in docs/guide/library.md docs/guide/versions.md cmake/morphrayConfig.cmake.in; do
    grep -q "find_package(morphray $series[ )]" "$root/$file" || fail "$file does not look for $series"
done
! grep -rnE 'morphray-[0-9]+\.[0-9]' "$root/docs/guide" | grep -vF "morphray-$version" ||
    fail "these lines name another version"
grep -qx "version: $version" "$root/CITATION.cff" || fail "CITATION.cff is not of $version"
# expect_chart CODE TEXT: how `morphray chart` into a folder that is not empty ends.
expect_chart() {
    local code=0 text
    text=$("$prefix/bin/morphray" chart builtin:cloth:500 --quick --out "$prefix" 2>&1) || code=$?
    [ "$code" = "$1" ] && grep -qF "$2" <<<"$text" || fail "chart ends with $code: $text"
}
expect_chart 5 "is not an empty folder"
mv "$prefix/libexec/morphray/morphray-chart" "$scratch/moved/"
expect_chart 4 "morphray-chart is missing"
mv "$scratch/moved/morphray-chart" "$prefix/libexec/morphray/"

"$cmake" -G Ninja -S "$prefix/share/doc/morphray/examples" -B "$scratch/examples" \
    -DCMAKE_CXX_COMPILER="$cxx" -DCMAKE_PREFIX_PATH="$prefix" \
    -DCMAKE_CXX_FLAGS="-Wconversion -Wno-sign-conversion -Werror" >/dev/null
"$cmake" --build "$scratch/examples"
for source in "$root"/library/examples/*.cpp; do
    example=$(basename "$source" .cpp)
    echo "== $example"
    "$scratch/examples/$example" || fail "$example ends with $?"
done

# A version that it is not, and a component that there is none of.
cat >"$scratch/refused.cmake" <<END
find_package(morphray $later CONFIG QUIET)
if(morphray_FOUND)
    message(FATAL_ERROR "$version is taken for $later")
endif()
END
"$cmake" -DCMAKE_PREFIX_PATH="$prefix" -P "$scratch/refused.cmake" 2>/dev/null ||
    fail "version $version satisfies $later"

echo "== first_ray with pkg-config"
export PKG_CONFIG_PATH=$library/pkgconfig
pkg-config --print-errors --exact-version="$version" morphray
# shellcheck disable=SC2046  # flags are words
"$cxx" -std=c++20 "$root/library/examples/first_ray.cpp" -o "$scratch/first_ray" \
    $(pkg-config --cflags --libs morphray) -Wl,-rpath,"$(pkg-config --variable=libdir morphray)"
"$scratch/first_ray"

# The build has no libraries in place of Embree's without its headers.
if [ -e "$build/bin/morphray-embree" ]; then
    echo "== morphray-embree"
    "$cmake" --install "$build" --prefix "$prefix" --component embree >/dev/null
    # Bytes of a longer path would stay behind the one that installing puts in its place.
    for file in "$build"/lib/morphray/embree/libembree?.so.?; do
        ! grep -qF "$build" "$file" || fail "$file names $build"
    done
    check_paths
    # shellcheck disable=SC2016  # the shell that it starts expands it
    folder=$("$prefix/bin/morphray-embree" sh -c 'echo "${LD_LIBRARY_PATH%%:*}"')
    [ "$(dirname "$folder")" = "$library/morphray" ] || fail "morphray-embree looks into $folder"
    [ ! -e "$folder/libembree3.so" ] || fail "linkers find libembree3.so"
    # It finds libmorphray from where it lies.
    for file in "$folder"/libembree?.so.?; do
        [[ $(ldd "$file") == *"libmorphray.so.$major => $prefix"* ]] || fail "$file finds no libmorphray"
    done
    code=0
    "$prefix/bin/morphray-embree" 2>/dev/null || code=$?
    [ "$code" = 2 ] || fail "morphray-embree without a program ends with $code"
fi
