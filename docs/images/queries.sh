#!/usr/bin/env bash
# queries.sh PROGRAM PICTURE: draws cuts through the signed distance of a scene at three frames, the
# picture of docs/guide/queries.md.
set -euo pipefail
program=$1 picture=$2
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

points=$scratch/points
awk 'BEGIN {
    for (j = -150; j <= 150; ++j) {
        for (i = -150; i <= 150; ++i) print i * 2.1 / 150, j * 2.1 / 150, 0
        print ""
    }
}' >"$points"
for frame in 0 3 6; do
    "$program" query builtin:spikes --frame $frame --points "$points" --ask distance \
        >"$scratch/distances"
    # Gnuplot takes a grid whose rows are apart by empty lines.
    awk -v distances="$scratch/distances" '
        NF == 0 { print; next }
        { getline d <distances; print $1, $2, d }' "$points" >"$scratch/cut_$frame"
done
gnuplot <<EOF
set terminal png truecolor size 1260,440 font "sans,11"
set output "$scratch/picture.png"
set multiplot
set view map
unset key
unset xtics
unset ytics
set border 31 lc rgb "#888888"
unset colorbox
set pm3d map
set size ratio -1
set cbrange [-1.2:1.2]
set palette maxcolors 24 defined (-1.2 "#173a6b", -0.3 "#5b93d3", 0 "#ffffff", 0.3 "#f2a07b", 1.2 "#a02a1a")
do for [i = 0:2] {
    frame = 3 * i
    set lmargin at screen (0.01 + 0.33 * i)
    set rmargin at screen (0.32 + 0.33 * i)
    set bmargin at screen 0.01
    set tmargin at screen 0.93
    set title sprintf("frame %d", frame) offset 0,-0.6
    unset contour
    splot [-2.1:2.1] [-2.1:2.1] sprintf("$scratch/cut_%d", frame) with pm3d
    unset title
    set contour base
    unset surface
    set cntrlabel onecolor
    set cntrparam levels discrete 0
    splot [-2.1:2.1] [-2.1:2.1] sprintf("$scratch/cut_%d", frame) with lines lc rgb "black" lw 2 nosurface
    set surface
}
unset multiplot
EOF
mv "$scratch/picture.png" "$picture"
