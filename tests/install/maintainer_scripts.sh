#!/usr/bin/env bash
# maintainer_scripts.sh ROOT: the package python3-morphray has its bytecode compiled and removed by
# Debian's tools, or removes it itself where these are not there.
set -euo pipefail
scripts=$1/cmake/package/python
fail() { echo "maintainer_scripts: $*" >&2; exit 1; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# Tools that write down how they are called, and a dpkg that knows the package.
mkdir "$scratch/tools" "$scratch/bare"
for tool in py3compile py3clean; do
    printf '#!/bin/sh\necho "%s $*" >>"%s/calls"\n' $tool "$scratch" >"$scratch/tools/$tool"
done
module=$scratch/dist-packages/morphray
mkdir -p "$module"
printf '#!/bin/sh\n[ "$*" = "-L python3-morphray" ] || exit 1\nprintf "%%s\\n" "%s" "%s" "%s"\n' \
    "$module" "$module/__init__.py" "$module/_morphray.so" >"$scratch/bare/dpkg"
chmod +x "$scratch"/tools/* "$scratch"/bare/*
for tool in sh sed rm rmdir; do ln -s "$(command -v $tool)" "$scratch/bare/$tool"; done

PATH=$scratch/tools:$PATH "$scripts/postinst" configure ""
PATH=$scratch/tools:$PATH "$scripts/postinst" abort-upgrade 0.1
PATH=$scratch/tools:$PATH "$scripts/prerm" remove
[ "$(cat "$scratch/calls")" = "py3compile -p python3-morphray
py3clean -p python3-morphray" ] || fail "Debian's tools are called by: $(cat "$scratch/calls")"

# plant FILE...: what Python leaves beside the module.
plant() {
    mkdir -p "$module/__pycache__"
    (cd "$module/__pycache__" && touch "$@")
}
plant __init__.cpython-311.pyc __init__.cpython-311.opt-1.pyc
PATH=$scratch/bare "$scripts/postinst" configure ""
PATH=$scratch/bare "$scripts/prerm" remove
[ ! -e "$module/__pycache__" ] || fail "prerm leaves $(ls "$module/__pycache__")"
plant __init__.cpython-311.pyc of_another_package.cpython-311.pyc
PATH=$scratch/bare "$scripts/prerm" remove
[ "$(ls "$module/__pycache__")" = of_another_package.cpython-311.pyc ] ||
    fail "prerm leaves $(ls "$module/__pycache__"), not what is another package's"
# Nothing was ever imported.
rm -r "$module/__pycache__"
PATH=$scratch/bare "$scripts/prerm" remove
