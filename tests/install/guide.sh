#!/usr/bin/env bash
# guide.sh PAGE INCLUDE GENERATED CXX: each C++ example of the page compiles.
set -euo pipefail
page=$1 include=$2 generated=$3 cxx=$4
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
awk -v folder="$scratch" '
    /^```cpp$/ { on = 1; ++n; next }
    /^```$/ { on = 0 }
    on { print >(folder "/example" n ".cpp") }' "$page"
count=0
for source in "$scratch"/*.cpp; do
    "$cxx" -std=c++20 -fsyntax-only -Wall -Wextra -Werror -I"$include" -I"$generated" "$source"
    count=$((count + 1))
done
[ $count -ge 2 ] || { echo "guide: only $count examples in $page" >&2; exit 1; }
