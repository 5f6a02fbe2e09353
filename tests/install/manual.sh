#!/usr/bin/env bash
# manual.sh PROGRAM FOLDER: the man pages and completions in FOLDER have all that PROGRAM's help has;
# mandoc finds no fault in the pages, and bash completes with the function.
set -euo pipefail
program=$1 folder=$2
fail() { echo "manual: $*" >&2; exit 1; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

commands=$("$program" help | awk '/^Commands/ { on = 1; next } /^$/ { on = 0 } on && /^  [^ ]/ { print $1 }')
for command in "" $commands; do
    page=$folder/man/morphray${command:+-$command}.1
    # shellcheck disable=SC2086  # no command, no word
    "$program" help $command >"$scratch/help"
    # Man pages are of the version, not of a date; the width of lines is a matter of taste.
    faults=$(mandoc -T lint "$page" | grep -v -e 'missing date' -e 'longer than 80 bytes' || true)
    [ -z "$faults" ] || fail "$faults"
    mandoc -T utf8 "$page" | sed "s/.\x08//g" | tr -s ' \n' ' ' >"$scratch/page"
    for option in $(grep -oE '^  (-[a-z],)?--[a-z,-]+' "$scratch/help" | grep -oE -- '--[a-z-]+'); do
        grep -qF -- "$option" "$scratch/page" || fail "$page lacks $option"
        for completion in morphray.bash _morphray; do
            grep -qF -- "$option" "$folder/completions/$completion" || fail "$completion lacks $option"
        done
        grep -qF -- " -l ${option#--} " "$folder/completions/morphray.fish" ||
            fail "morphray.fish lacks $option"
    done
    if [ -n "$command" ]; then
        grep -q "EXAMPLES .* morphray $command" "$scratch/page" || fail "$page lacks an example"
    fi
    for code in 0 8 70 129 130 143; do grep -qE " $code +[a-z]" "$scratch/page" || fail "$page: no exit code $code"; done
done

bash -n "$folder/completions/morphray.bash"
# shellcheck source=/dev/null
. "$folder/completions/morphray.bash"

# expect "WORDS, cut as bash cuts them" "REPLIES": the last word is completed.
expect() {
    local -a COMP_WORDS COMPREPLY
    local COMP_CWORD IFS=' '
    eval "COMP_WORDS=($1)"
    COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
    _morphray
    [ "${COMPREPLY[*]}" = "$2" ] || fail "'$1' completes to '${COMPREPLY[*]}', not to '$2'"
}
mkdir "$scratch/files" "$scratch/files/frames"
touch "$scratch/files/mesh.obj" "$scratch/files/notes.txt"
cd "$scratch/files"
expect "morphray re" render
expect "morphray help cro" crosscheck
expect "morphray render --missing ''" "fail hold skip"
expect "morphray render --backend = v" vulkan
expect "morphray render --up" "--up --update --update-budget"
expect "morphray render scene.obj --build b" binned
expect "morphray render --shading ''" "lit plain normal depth prim steps sah"
expect "morphray render --samples 1" "1 16"
expect "morphray profile --policies ''" "refit rebuild every: auto"
expect "morphray profile --policies refit,re" "refit,refit refit,rebuild"
expect "morphray diff n" notes.txt
expect "morphray render -o ''" frames
expect "morphray crosscheck --backend ''" "all cpu vulkan"
expect "morphray render buil" "builtin:cloth builtin:twist builtin:herd builtin:explode builtin:shuffle \
builtin:soup builtin:spikes builtin:collapse builtin:wave builtin:orbits builtin:gather \
builtin:teleport builtin:swing builtin:hall builtin:room builtin:kitchen builtin:hair builtin:degenerate"
expect "morphray render builtin : cl" cloth
expect "morphray render builtin :" "cloth twist herd explode shuffle soup spikes collapse wave orbits \
gather teleport swing hall room kitchen hair degenerate"
expect "morphray info m" mesh.obj
expect "morphray info fr" frames
expect "morphray render --out ''" frames
expect "morphray render --hits n" notes.txt
expect "morphray render --size ''" ""
