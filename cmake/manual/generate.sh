#!/bin/sh
# generate.sh PROGRAM VERSION FOLDER: writes FOLDER/man/*.1 and FOLDER/completions/* from what
# PROGRAM says of itself. parse_help.awk turns each help text into lines of fields; the others write
# from those lines.
set -eu
program=$1 version=$2 folder=$3
here=$(dirname "$0")
export LC_ALL=C
rm -rf "$folder"
mkdir -p "$folder/man" "$folder/completions"
lines=$folder/help.tsv

parse() { awk -v command="$1" -f "$here/parse_help.awk"; }

"$program" help | parse "" >"$lines"
commands=$(awk -F '\t' '$1 == "command" { print $3 }' "$lines")
for command in $commands; do
    "$program" help "$command" | parse "$command" >>"$lines"
done
# Without drivers, which the list of scenes does not need.
VK_DRIVER_FILES=/dev/null VK_ICD_FILENAMES=/dev/null "$program" info | awk '$1 ~ /^builtin:/ { print "scene\t\t" $1 "\t\t0\t" }' >>"$lines"

for kind in command option positional example scene; do
    grep -q "^$kind	" "$lines" || { echo "generate.sh: the help shows no $kind" >&2; exit 1; }
done

for command in "" $commands; do
    awk -v command="$command" -v version="$version" -f "$here/man_page.awk" "$lines" \
        >"$folder/man/morphray${command:+-$command}.1"
done
for shell in bash zsh fish; do
    case $shell in zsh) name=_morphray ;; *) name=morphray.$shell ;; esac
    awk -f "$here/values.awk" -f "$here/$shell.awk" "$lines" >"$folder/completions/$name"
done
touch "$folder/stamp"
