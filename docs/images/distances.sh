#!/usr/bin/env bash
# distances.sh TABLE PICTURE: draws the largest errors of a table of lab/bench/distances, the picture of
# docs/design/arithmetic.md, "Distances".
set -euo pipefail
table=$1 picture=$2
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# scene, points; errors by the size of ours, Embree, CGAL and Open3D.
awk -F'|' 'NR > 2 {
    gsub(/^ +| +$/, "", $2); sub(/^builtin:/, "", $2); sub(/:.*/, "", $2)
    gsub(/^ +| +$/, "", $3)
    for (i = 4; i <= 7; ++i) sub(/;.*/, "", $i)
    printf "\"%s,\\n%s\" %s %s %s %s\n", $2, $3, $4, $5, $6, $7
}' "$table" >"$scratch/errors"
gnuplot <<PLOT
set terminal png truecolor size 1260,470 font "sans,11"
set output "$scratch/picture.png"
set logscale y
set yrange [0.1:2e6]
set format y "10^{%T}"
set ylabel "largest error, in 2^{–24} of the farthest corner's distance"
set style data histograms
set style histogram clustered gap 1.5
set style fill solid
set boxwidth 0.9
set grid y lc rgb "#dddddd"
set bmargin 3.5
set border 3 lc rgb "#888888"
set xtics nomirror scale 0
set ytics nomirror
set key top right horizontal
plot 8 with lines lw 2 lc rgb "black" title "our bound", \
    "$scratch/errors" using 2:xtic(1) lc rgb "#173a6b" title "ours", \
    "" using 4 lc rgb "#9fc0e8" title "CGAL, doubles", \
    "" using 3 lc rgb "#e0733f" title "Embree, Ericson's method", \
    "" using 5 lc rgb "#f4b78f" title "Open3D"
PLOT
mv "$scratch/picture.png" "$picture"
