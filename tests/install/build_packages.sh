#!/usr/bin/env bash
# build_packages.sh ROOT SCRATCH CMAKE CXX: cmake/build_packages.cmake writes the versions of installed packages, with
# a dpkg-query that is made for it, and none where there are none to ask for; what it writes compiles.
set -euo pipefail
root=$1 scratch=$2/build_packages cmake=$3 cxx=$4
fail() { echo "build_packages: $*" >&2; exit 1; }
header=$scratch/common/report/build_packages.h

rm -rf "$scratch"
mkdir -p "$scratch"
cat >"$scratch/dpkg-query" <<'DONE'
#!/bin/sh
printf '%s\n' "$@" >"$0.arguments"
cat <<LINES
zlib1g-dev 1:1.2.13.dfsg-1 installed
libfmt-dev 9.1.0+ds1-2 installed
libfmt-dev 9.1.0+ds1-2 installed
gnuplot-nox 5.4.4 config-files
libhwy-dev  not-installed
libstb-dev 0.0~git20220908 installed
LINES
echo "dpkg-query: no packages found matching libnone-dev" >&2
exit 1
DONE
chmod +x "$scratch/dpkg-query"

# write NAMES
write() {
    "$cmake" -D NAMES="$1" -D DPKG_QUERY="$scratch/dpkg-query" -D TEMPLATE="$root/common/report/build_packages.h.in" \
        -D OUTPUT="$header" -P "$root/cmake/build_packages.cmake"
}
# expect_packages "NAME VERSION..."
expect_packages() {
    printf '#include "common/report/build_packages.h"\n#include <iostream>\nint main() {\n%s\n}\n' \
        'for (const auto& p : mray::kBuildPackages) std::cout << p.name << " " << p.version << "; ";' \
        >"$scratch/main.cpp"
    "$cxx" -std=c++20 -Wall -Werror -I"$scratch" -I"$root" -o "$scratch/main" "$scratch/main.cpp"
    local found
    found=$("$scratch/main")
    [ "$found" = "$1" ] || fail "the packages are '$found', not '$1'"
}

write "zlib1g-dev,libfmt-dev,libnone-dev"
for name in zlib1g-dev libfmt-dev libnone-dev; do
    grep -qx "$name" "$scratch/dpkg-query.arguments" || fail "$name is not asked for"
done
expect_packages "libfmt-dev 9.1.0+ds1-2; libstb-dev 0.0~git20220908; zlib1g-dev 1:1.2.13.dfsg-1; "
touch -d @1 "$header"
write "zlib1g-dev,libfmt-dev,libnone-dev"
[ "$(stat -c %Y "$header")" = 1 ] || fail "a header that is right is written again"
write ""
expect_packages ""
