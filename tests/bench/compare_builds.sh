#!/usr/bin/env bash
# compare_builds.sh PROGRAM BUILD: PROGRAM finds that BUILD and a copy of it, which is loaded as another
# build, trace the same answers, and refuses what it cannot compare.
set -euo pipefail
program=$1 build=$2
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
copy=$scratch/copy.so
cp "$build" "$copy"

fail() { printf '%s\n' "$*" "$(cat "$scratch/out")" >&2; exit 1; }

# expect CODE ARGUMENTS...: the exit code; what the program says is in $scratch/out.
expect() {
    local expected=$1 code=0
    shift
    "$program" "$@" >"$scratch/out" 2>&1 || code=$?
    [ "$code" = "$expected" ] || fail "exit code $code instead of $expected: $*"
}

expect 0 "$build" "$copy" --repeat 1 --work primary,ao --csv "$scratch/rows.csv" builtin:cloth:1000
for tracer in primary,packet primary,stream primary,single ao,stream ao,single; do
    grep -qE "^builtin:cloth:1000,$tracer,.*,0$" "$scratch/rows.csv" || fail "no row of $tracer"
done

expect 2 "$build" "$copy" --work nothing builtin:cloth:1000
grep -qF 'nothing: no such work' "$scratch/out" || fail 'no message for a work that does not exist'
expect 2 "$build"
expect 1 "$build" "$scratch/missing.so" builtin:cloth:1000
expect 1 "$build" "$scratch/out" builtin:cloth:1000
