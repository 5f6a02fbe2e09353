#!/usr/bin/env bash
# subdirectory.sh ROOT SCRATCH CMAKE CXX LAUNCHER: builds a project that has ROOT as a folder of its
# own and runs what it links to morphray::morphray and to morphray::static. To be quick, without
# Vulkan, SIMD and optimisation.
set -euo pipefail
root=$1 build=$2/subdirectory cmake=$3 cxx=$4 launcher=$5
"$cmake" -G Ninja -S "$root/tests/install/subdirectory" -B "$build" -DMORPHRAY_ROOT="$root" \
    -DCMAKE_CXX_COMPILER="$cxx" -DCMAKE_CXX_COMPILER_LAUNCHER="$launcher" \
    -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0 \
    -DMORPHRAY_VULKAN=OFF -DMORPHRAY_SIMD=OFF >/dev/null
"$cmake" --build "$build" --target shared_user static_user
"$build/shared_user"
"$build/static_user"
if ctest --test-dir "$build" -N | grep -E '^ *Test +#'; then
    echo "subdirectory: the project above has morphray's tests" >&2
    exit 1
fi
