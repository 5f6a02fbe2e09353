#!/usr/bin/env bash
# exports.sh LIBRARY NM: the shared library exports names of morphray:: and nothing else.
set -euo pipefail
library=$1 nm=$2

# Prints the names that the library must not export, from lines of nm.
foreign() {
    sed -E 's/^[0-9a-f]* +[A-Za-z] //' | grep -vE \
        '^((typeinfo|typeinfo name|vtable) for )?morphray::[A-Za-z]|^MORPHRAY_0(@@MORPHRAY_0)?$' || true
}

names=$("$nm" -DC --defined-only "$library")
bad=$(foreign <<<"$names")
[ -z "$bad" ] || { printf 'exports: not of morphray::\n%s\n' "$bad" >&2; exit 1; }
for needed in 'morphray::Scene::build(' 'morphray::Scene::intersect(' 'morphray::version()' \
    'typeinfo for morphray::Error'; do
    grep -qF "$needed" <<<"$names" || { echo "exports: no $needed" >&2; exit 1; }
done
grep -c . <<<"$names"
