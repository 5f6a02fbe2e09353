#!/usr/bin/env bash
# hardening.sh ROOT SCRATCH CMAKE CXX: whatever the preset "package" links is hardened, and the check
# that packages go through can fail.
set -euo pipefail
root=$1 scratch=$2/hardened cmake=$3 cxx=$4
check=$root/cmake/package/check_hardening.sh
fail() { echo "hardening: $*" >&2; exit 1; }

"$cmake" -G Ninja -S "$root/tests/install/hardened" -B "$scratch" -DPRESET=package \
    -DPRESETS="$root/CMakePresets.json" -DCMAKE_CXX_COMPILER="$cxx" >/dev/null
"$cmake" --build "$scratch" >/dev/null
count=$("$check" "$scratch/linked")
[ "$count" = 3 ] || fail "$count files are checked, not a program, a library and a module"

mkdir -p "$scratch/planted"
"$cxx" -shared -Wl,-z,lazy -Wl,-z,norelro -o "$scratch/planted/lazy.so" -xc++ /dev/null
printf 'int main() {}' | "$cxx" -no-pie -o "$scratch/planted/fixed" -xc++ -
if "$check" "$scratch/planted" 2>"$scratch/faults"; then fail "the check accepts anything"; fi
for fault in "lazy.so has no RELRO" "lazy.so has no immediate binding" \
    "fixed is not position-independent"; do
    grep -q "/$fault" "$scratch/faults" || fail "the check does not find that $fault"
done
