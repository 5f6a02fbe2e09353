#!/usr/bin/env bash
# headers.sh INCLUDE GENERATED CXX: each public header compiles alone, without warnings, and brings in the
# standard library and nothing else.
set -euo pipefail
include=$1 generated=$2 cxx=$3
headers=("$include"/morphray/*.hpp "$generated"/morphray/*.hpp)

# Lines "#include <...>" of the standard library have no dot and no slash.
if grep -HnE '^ *# *include' "${headers[@]}" |
    grep -vE '#include (<[a-z_0-9]+>|"morphray/[a-z_]+\.hpp")$'; then
    echo "headers: not the standard library" >&2
    exit 1
fi
printf '%s\0' "${headers[@]}" | xargs -0 -I{} -P 2 "$cxx" -std=c++20 -fsyntax-only -Wall -Wextra -Wpedantic \
    -Wshadow -Wconversion -Werror -I"$include" -I"$generated" -include {} -xc++ /dev/null
