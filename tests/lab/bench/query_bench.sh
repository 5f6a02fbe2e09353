#!/usr/bin/env bash
# query_bench.sh PROGRAM: the work `queries` of PROGRAM measures every question against every peer on a
# small scene, and all answers are the same.
set -euo pipefail
program=$1
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

"$program" --only --size 32 --threads 1 --repeat 1 --work queries --csv "$scratch/rows.csv" \
    builtin:spikes:1000 >"$scratch/out" 2>&1 || { cat "$scratch/out" >&2; exit 1; }

fail() { printf '%s\n' "$*" "$(cat "$scratch/rows.csv")" >&2; exit 1; }

# expect QUESTION PEER: one row, without mismatches, whose distances differ by less than a millionth.
expect() {
    local rows
    rows=$(grep -cE "^builtin:spikes:1000,.*,queries,1,1024,.*\"$1\".*,ns/query,.*$2.*,0,([0-9.]+e-(0[7-9]|[1-9][0-9])|0)$" \
        "$scratch/rows.csv" || true)
    [ "$rows" = 1 ] || fail "$rows rows of $1 against $2"
}

for points in near 'in box' 'near, sorted' 'in box, sorted'; do
    for peer in 'Embree PointQuery robust' 'Embree PointQuery fast'; do
        expect "closest_points, $points" "$peer"
    done
    if grep -q CGAL "$scratch/rows.csv"; then expect "closest_points, $points" 'CGAL .* AABB_tree'; fi
done
for question in 'count, camera' 'count, random' 'contains, near' 'contains, in box'; do
    for peer in 'Embree Intersect1 with a filter robust' 'Embree Intersect1 with a filter fast'; do
        expect "$question" "$peer"
    done
done
