#!/bin/sh
# localize.sh ARCHIVE CXX NM OBJCOPY AR: makes one object of the archive's objects, in which all names
# that are hidden are local: a program may have another volk or tinyobjloader. What a compiler shares
# between the objects of a program becomes this object's own (groups) or weak ("unique" symbols).
set -eu
archive=$1 cxx=$2 nm=$3 objcopy=$4 ar=$5
object=$(dirname "$archive")/morphray.o names=$(dirname "$archive")/unique_names
"$cxx" -r -nostdlib -Wl,--force-group-allocation -o "$object" -Wl,--whole-archive "$archive"
"$nm" "$object" | awk '$2 == "u" { print $3 }' >"$names"
"$objcopy" --weaken-symbols="$names" "$object"
"$objcopy" --localize-hidden "$object"
rm "$archive" "$names"
"$ar" qcsD "$archive" "$object"
rm "$object"
