#!/usr/bin/env bash
# doxygen.sh ROOT OUTPUT: Doxygen reads the public headers without a warning.
set -euo pipefail
root=$1 output=$2
mkdir -p "$output"
(
    cat "$root/docs/Doxyfile"
    printf 'OUTPUT_DIRECTORY = "%s"\nINPUT = "%s/library/include/morphray"\nSTRIP_FROM_PATH = "%s/library/include"\n' \
        "$output" "$root" "$root"
) | doxygen - >"$output/log" 2>"$output/warnings" || { cat "$output/warnings" >&2; exit 1; }
[ ! -s "$output/warnings" ] || { cat "$output/warnings" >&2; exit 1; }
[ -e "$output/html/classmorphray_1_1Scene.html" ]
