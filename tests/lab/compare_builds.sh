#!/usr/bin/env bash
# compare_builds.sh PROGRAM BUILD WRONG: PROGRAM finds that BUILD and a copy of it, which is loaded as
# another build, trace the same answers, that WRONG (wrong_build.cpp) does not, and refuses what it cannot
# compare.
set -euo pipefail
program=$1 build=$2 wrong=$3
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
copy=$scratch/copy.so
cp "$build" "$copy"

fail() { printf '%s\n' "$*" "$(cat "$scratch/out")" >&2; exit 1; }

# expect CODE ARGUMENTS...: the exit code; what the program says is in $scratch/out.
expect() {
    local expected=$1 code=0
    shift
    "$program" builds "$@" >"$scratch/out" 2>&1 || code=$?
    [ "$code" = "$expected" ] || fail "exit code $code instead of $expected: $*"
}

# expect_rows DIFFERENCES: under each work is a row for each tracer, with DIFFERENCES differences.
expect_rows() {
    local row
    for row in packet:1 stream:2 single:2; do
        [ "$(grep -cE "^${row%:*} .* $1$" "$scratch/out")" = "${row#*:}" ] ||
            fail "not ${row#*:} rows of ${row%:*} with $1"
    done
}

options=(--repeat 1 --work primary,ao builtin:cloth:1000)
expect 0 "$build" "$copy" "${options[@]}"
expect_rows 0
export MORPHRAY_BUILD=$copy
expect 1 "$build" "$wrong" "${options[@]}"
expect_rows 1

MORPHRAY_INTERFACE=other expect 2 "$build" "$wrong" builtin:cloth:1000
grep -qF ': interface ' "$scratch/out" || fail 'no message for another interface'
expect 2 "$build" "$copy" --work nothing builtin:cloth:1000
expect 2 "$build"
expect 2 "$build" "$scratch/missing.so" builtin:cloth:1000
expect 2 "$build" "$scratch/out" builtin:cloth:1000
