#!/usr/bin/env bash
# check_hardening.sh FOLDER: each program, shared library and module in FOLDER is position-independent
# and has RELRO and immediate binding, as docs/guide/library.md promises. Prints how many there are.
set -euo pipefail
folder=$1
count=0 faults=0
fault() { echo "check_hardening: $1 $2" >&2; faults=$((faults + 1)); }

while IFS= read -r -d '' file; do
    # Archives, and objects in them, are linked by whoever takes them.
    [[ $file != *.[ao] ]] || continue
    [ "$(head -c 4 "$file" | tr -d '\0')" = $'\x7fELF' ] || continue
    count=$((count + 1))
    grep -qE 'Type: +DYN ' <<<"$(readelf -Wh "$file")" || fault "$file" "is not position-independent"
    grep -q GNU_RELRO <<<"$(readelf -Wl "$file")" || fault "$file" "has no RELRO"
    grep -qE 'BIND_NOW|Flags:.* NOW' <<<"$(readelf -Wd "$file")" ||
        fault "$file" "has no immediate binding"
done < <(find "$folder" -type f -print0)
[ $faults -eq 0 ] || exit 1
echo $count
