#!/usr/bin/env bash
# check_docs.sh ROOT PROGRAM [FILE...]: fails with a line for each name in the Markdown files of the
# checkout (or in FILEs, taken as pages of ROOT/docs) that does not exist:
#
#   - a link to a file or a heading
#   - a file or folder in backticks; a file without a folder may lie anywhere
#   - an --option that neither PROGRAM's help nor a script of the checkout has
#   - in backticks: Class::member, kConstant, snake_case, and Suite.Test names
#
# Without FILEs also: a path of docs/ that a source names, and an option of PROGRAM that
# docs/guide/options.md lacks.
set -euo pipefail
export LC_ALL=C
root=$1 program=$2
shift 2
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

find "$root" \( -name build -o -name .git -o -name out \) -prune -o -type f -printf '%P\n' \
    >"$scratch/files"
find "$root" \( -name build -o -name .git -o -name out \) -prune -o -type d -printf '%P\n' \
    >"$scratch/folders"
grep -E '\.(h|hpp|awk|cpp|comp|glsl|g|in|cmake|sh|txt)$|^(\.ci/run|run|test|fuzz|verify|tests/verify/run|bench/run|bench/updates|bench/growth|bench/clips|bench/readers|bench/farm|bench/builds|cmake/(package|wheel)/run|tests/mutation/(run|propose))$|CMakePresets.json' \
    "$scratch/files" | grep -v '^tests/docs/' >"$scratch/sources"
pages=("$@")
if [ $# -eq 0 ]; then
    mapfile -t pages < <(grep -E '\.md$' "$scratch/files" | sed "s|^|$root/|")
fi

# Lines "page<TAB>kind<TAB>name".
awk '
    FNR == 1 { fenced = 0 }
    /^ *```/ { fenced = !fenced; next }
    {
        line = $0
        while (match(line, /--[a-z][a-z-]*[a-z]/)) {
            # Not a rule of a table, nor the end of a longer word.
            before = RSTART > 1 ? substr(line, RSTART - 1, 1) : " "
            if (before !~ /[A-Za-z0-9-]/)
                print FILENAME "\toption\t" substr(line, RSTART, RLENGTH)
            line = substr(line, RSTART + RLENGTH)
        }
        if (fenced || /^    /) next
        line = $0
        while (match(line, /\]\([^)]*\)/)) {
            print FILENAME "\tlink\t" substr(line, RSTART + 2, RLENGTH - 3)
            line = substr(line, RSTART + RLENGTH)
        }
        n = split($0, part, "`")
        for (i = 2; i <= n; i += 2) print FILENAME "\tcode\t" part[i]
    }' "${pages[@]}" | sort -u >"$scratch/names"

complaints=$scratch/complaints
: >"$complaints"
complain() { printf '%s: %s\n' "${1#"$root"/}" "$2" >>"$complaints"; }

# The heading as GitHub names it in a link.
headings() {
    grep -E '^#+ ' "$1" | sed -E 's/^#+ //' | tr 'A-Z' 'a-z' | sed -E 's/[^a-z0-9 _-]//g; s/ /-/g'
}

while IFS=$'\t' read -r page _ link; do
    case $link in http:* | https:* | mailto:*) continue ;; esac
    file=${link%%#*} folder=$(dirname "$page")
    [ $# -eq 0 ] || folder=$root/docs
    target=$folder/$file
    [ -n "$file" ] || target=$page
    if [ ! -e "$target" ]; then
        complain "$page" "link to $link, which does not exist"
    elif [[ $link == *#* ]] && ! grep -qxF -- "${link#*#}" <<<"$(headings "$target")"; then
        complain "$page" "link to $link, a heading that does not exist"
    fi
done < <(grep -P '\tlink\t' "$scratch/names" || true)

# Files and folders: what begins with a folder of the checkout, or ends like a source.
tops=$(grep -v / "$scratch/folders" | grep . | paste -sd'|')
while IFS=$'\t' read -r page _ name; do
    # "./run ARGS" is the file "run".
    path=${name%% *}
    path=${path#./}
    [[ $path =~ ^[A-Za-z0-9_./*-]+$ ]] || continue
    # A word in capitals stands for any name.
    [[ ! $path =~ [A-Z]{2} || -e $root/$path ]] || continue
    if [[ $path =~ ^($tops)/ ]]; then
        # shellcheck disable=SC2086  # a pattern may stand for several files
        compgen -G "$root/$path" >/dev/null ||
            complain "$page" "\`$name\`: no such file or folder"
    elif [[ $path =~ \.(h|hpp|cpp|comp|glsl|cmake|g|sh|md)$ ]]; then
        pattern=${path//./\\.}
        pattern=${pattern//\*/[^/]*}
        grep -qE "(^|/)$pattern\$" "$scratch/files" || complain "$page" "\`$name\`: no such file"
    fi
done < <(grep -P '\tcode\t' "$scratch/names" || true)

# Options: of the program, of scripts and other programs of the checkout, and of cmake, gcovr,
# pkg-config, venv, sbatch and parallel.
{
    "$program" --help
    for command in $("$program" --help | awk '/^Commands/ { on = 1; next } /^$/ { on = 0 } on && /^  [^ ]/ { print $1 }'); do
        "$program" help "$command"
    done
} >"$scratch/help"
grep -ohE -- '--[a-z][a-z-]*[a-z]' "$scratch/help" | sort -u >"$scratch/program_options"
{
    cat "$scratch/program_options"
    (cd "$root" && cat run test fuzz tests/verify/run .ci/run bench/run bench/updates bench/growth bench/clips bench/readers bench/farm bench/builds bench/open3d bench/choices bench/distances cmake/setup.sh cmake/package/run cmake/wheel/run bench/options.* \
        bench/two_builds/options.cpp \
        tests/fuzz/run/options.* tests/mutation/run tests/mutation/propose) | grep -ohE -- '--[a-z][a-z-]*[a-z]'
    printf -- '--%s\n' preset workflow list-presets root follow fix build target install prefix cflags libs \
        system-site-packages array cpus-per-task time dependency wrap sshloginfile wd
} | sort -u >"$scratch/options"
grep -P '\toption\t' "$scratch/names" | while IFS=$'\t' read -r page _ option; do
    grep -qxF -- "$option" "$scratch/options" ||
        complain "$page" "$option: neither the program nor a script has this option"
done || true

# Identifiers.
grep -P '\tcode\t' "$scratch/names" | while IFS=$'\t' read -r page _ name; do
    # The lab tells of code that was deleted.
    [[ $page != */docs/lab/* ]] || continue
    name=${name%()}
    if [[ $name =~ ^[A-Z][A-Za-z0-9]*\.[A-Z][A-Za-z0-9]*$ ]]; then
        printf '%s\t%s\t%s\n' "$page" "$name" "${name#*.}"
    elif [[ $name =~ ^[A-Za-z_][A-Za-z0-9_]*(::[A-Za-z_][A-Za-z0-9_]*)+$ ]]; then
        printf '%s\t%s\t%s\n' "$page" "$name" "${name%%::*}" "$page" "$name" "${name##*::}"
    elif [[ $name =~ ^k[A-Z][A-Za-z0-9]*$ || $name =~ ^[a-z]+[a-z0-9]*(_[a-z0-9]+)+$ ]]; then
        printf '%s\t%s\t%s\n' "$page" "$name" "$name"
    fi
done >"$scratch/identifiers" || true
cut -f3 "$scratch/identifiers" | sort -u >"$scratch/words"
sed "s|^|$root/|" "$scratch/sources" | xargs -d '\n' grep -ohwF -f "$scratch/words" |
    sort -u >"$scratch/known" || true
while IFS=$'\t' read -r page name word; do
    grep -qxF -- "$word" "$scratch/known" || complain "$page" "\`$name\`: no source has $word"
done <"$scratch/identifiers"

if [ $# -eq 0 ]; then
    while IFS=: read -r file path; do
        [ -e "$root/$path" ] || complain "$file" "$path does not exist"
    done < <(cd "$root" && xargs -d '\n' grep -oE 'docs/[a-z_]+(/[a-z0-9_]+)*\.md' <"$scratch/sources")
    grep -ohE -- '--[a-z][a-z-]*[a-z]' "$root/docs/guide/options.md" | sort -u >"$scratch/described"
    comm -23 "$scratch/program_options" "$scratch/described" | while read -r option; do
        complain docs/guide/options.md "$option is missing"
    done
fi

[ ! -s "$complaints" ] || { sort -u "$complaints" >&2; exit 1; }
