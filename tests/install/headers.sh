#!/usr/bin/env bash
# headers.sh INCLUDE GENERATED CXX: each public header compiles alone, without warnings, by CXX and
# by each of g++ and clang++ that is here, and brings in the standard library and nothing else.
set -euo pipefail
include=$1 generated=$2 cxx=$3
fail() { echo "headers: $*" >&2; exit 1; }

compilers=("$cxx")
for other in g++ clang++; do
    if command -v $other >/dev/null && [ "$(readlink -f "$(command -v $other)")" != "$(readlink -f "$cxx")" ]; then
        compilers+=("$other")
    fi
done

# Lines "#include <...>" of the standard library have no dot and no slash.
bad=$(grep -HnE '^ *# *include' "$include"/morphray/*.hpp "$generated"/morphray/*.hpp |
    grep -vE '#include (<[a-z_0-9]+>|"morphray/[a-z_]+\.hpp")$' || true)
[ -z "$bad" ] || fail "not the standard library: $bad"

count=0
for header in "$include"/morphray/*.hpp "$generated"/morphray/*.hpp; do
    name=morphray/$(basename "$header")
    for compiler in "${compilers[@]}"; do
        for linkage in -UMORPHRAY_STATIC -DMORPHRAY_STATIC; do
            [ $linkage = -UMORPHRAY_STATIC ] || [ "$name" = morphray/morphray.hpp ] || continue
            # Included twice: the second time must add nothing.
            printf '#include <%s>\n#include <%s>\n' "$name" "$name" |
                "$compiler" -std=c++20 -fsyntax-only -Wall -Wextra -Wpedantic -Wshadow -Wconversion \
                    -Werror $linkage -I"$include" -I"$generated" -xc++ - || fail "$name by $compiler"
        done
    done
    count=$((count + 1))
done
[ $count -ge 10 ] || fail "only $count headers in $include"
echo "$count headers by ${compilers[*]}"
