#!/usr/bin/env bash
# release.sh ROOT SCRATCH CMAKE CXX: makes the release of a copy of ROOT without compiling it. Then configures a project
# that fetches the source archive, and compiles what it links to morphray::morphray. The test `install` links and
# runs such programs.
set -euo pipefail
root=$1 copy=$2/release build=$2/fetch_content cmake=$3 cxx=$4
fail() { echo "release: $*" >&2; exit 1; }
rm -rf "$copy"
mkdir -p "$copy"
tar -C "$root" --exclude=./build --exclude=./out --exclude=./.git -c . | tar -x -C "$copy"
cd "$copy"
version=$(sed -n 's/^project(morphray VERSION \([0-9.]*\) .*/\1/p' CMakeLists.txt)
for made in package/run:made.deb wheel/run:made.whl aarch64/run:made_arm.whl; do
    mkdir -p "cmake/${made%/*}"
    printf '#!/bin/sh\necho "$@" >build/%s\necho build/%s\n' "${made#*:}" "${made#*:}" >"cmake/${made%:*}"
    chmod +x "cmake/${made%:*}"
done
export GIT_CONFIG_GLOBAL=/dev/null GIT_CONFIG_SYSTEM=/dev/null
export GIT_AUTHOR_NAME=a GIT_AUTHOR_EMAIL=a GIT_COMMITTER_NAME=a GIT_COMMITTER_EMAIL=a
# With one date the archive has the same bytes each time.
export GIT_AUTHOR_DATE=2026-01-01T00:00:00Z GIT_COMMITTER_DATE=2026-01-01T00:00:00Z
git init -q
git add .
git commit -q -m copy

expect_refusal() { # TEXT
    local code=0 text
    text=$(cmake/release/run 2>&1) || code=$?
    [ "$code" = 2 ] && grep -qF "$1" <<<"$text" || fail "the run ends with $code: $text"
    [ ! -e build/release-files ] || fail "a refused run has made files"
}
expect_refusal "HEAD has no tag v$version"
git tag "v$version"
touch not_committed
expect_refusal "the checkout has changes"
rm not_committed
cmake/release/run 3.11 >/dev/null
cd build/release-files
archive=morphray-$version.tar.gz
[ "$(echo *)" = "NOTES.md SHA256SUMS made.deb made.whl made_arm.whl $archive" ] || fail "there are $(echo *)"
sha256sum --quiet -c SHA256SUMS
[ "$(cat made.whl made_arm.whl)" = 3.11$'\n'3.11 ] || fail "no wheels for 3.11, but for $(cat made.whl made_arm.whl)"
grep -q '^### ' NOTES.md || fail "the notes have no section"
! grep '^## ' NOTES.md || fail "the notes have this heading of a version"

"$cmake" -G Ninja -S "$root/tests/install/fetch_content" -B "$build" -DMORPHRAY_ARCHIVE="file://$PWD/$archive" \
    -DMORPHRAY_SHA256="$(sha256sum <"$archive" | cut -d ' ' -f 1)" \
    -DCMAKE_CXX_COMPILER="$cxx" -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0 \
    -DMORPHRAY_VULKAN=OFF -DMORPHRAY_SIMD=OFF >/dev/null
"$cmake" --build "$build" --target morphray_version \
    CMakeFiles/shared_user.dir/_deps/morphray-src/library/examples/first_ray.cpp.o
grep -qF "\"$version (v$version)\"" "$build/_deps/morphray-build/generated/common/version.h" ||
    fail "the archive does not name its tag"
if ctest --test-dir "$build" -N | grep -E '^ *Test +#'; then
    fail "the project above has morphray's tests"
fi
