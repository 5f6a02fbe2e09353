#!/usr/bin/env bash
# subdirectory.sh ROOT SCRATCH CMAKE CXX: configures a project that has ROOT as a folder of its own, and compiles
# what it links to morphray::morphray. The test `install` links and runs such programs.
set -euo pipefail
root=$1 build=$2/subdirectory cmake=$3 cxx=$4
"$cmake" -G Ninja -S "$root/tests/install/subdirectory" -B "$build" -DMORPHRAY_ROOT="$root" \
    -DCMAKE_CXX_COMPILER="$cxx" -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0 \
    -DMORPHRAY_VULKAN=OFF -DMORPHRAY_SIMD=OFF >/dev/null
"$cmake" --build "$build" --target "CMakeFiles/shared_user.dir$root/library/examples/first_ray.cpp.o"
if ctest --test-dir "$build" -N | grep -E '^ *Test +#'; then
    echo "subdirectory: the project above has morphray's tests" >&2
    exit 1
fi
