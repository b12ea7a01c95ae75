#!/usr/bin/env bash
# compile_time.sh [--full [FOLDER]]: processor time [s] to compile one translation unit with the whole public interface, as
# JSON. --full also builds everything from nothing, in a folder that is not there yet and stays, or in a temporary one.
# CXX chooses the compiler. Processor time and not the clock: the machine may be busy.
set -euo pipefail
cd "$(dirname "$0")/.."
compiler=${CXX:-c++}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
rooms=(phs mechanics integrators energy_shaping vsa space scene)
unit=$work/unit.cpp
TIMEFORMAT='%U %S'

processor_time() { # the sum of user and system time of a command
  { time "$@" >/dev/null 2>"$work/errors"; } 2>&1 | awk '{ print $1 + $2 }'
}
compile() { processor_time "$compiler" -std=c++20 -O2 -I. -isystem /usr/include/eigen3 -DTOML_HEADER_ONLY=1 -w -c "$unit" -o "$work/unit.o"; }
least() { # of two
  for _ in 1 2; do compile; done | sort -g | head -1
}

git ls-files -- "${rooms[@]/%//*.h}" | grep -v -e '-inl\.h$' | sed 's/.*/#include "&"/' >"$unit"
echo 'int main() {}' >>"$unit"
headers=$(grep -c include "$unit")
"$compiler" -std=c++20 -fsyntax-only -I. -isystem /usr/include/eigen3 -DTOML_HEADER_ONLY=1 -w "$unit" >&2
everything=$(least)
printf '#include "mechanics/urdf.h"\n#include "mechanics/mechanical_model.h"\n#include "integrators/core/integrator.h"\nint main() {}\n' >"$unit"
typical=$(least)
full=null wall=null
if [[ ${1:-} == --full ]]; then
  folder=${2:-$work/build}
  [[ ! -e $folder ]] || { echo "$folder is there already: a full build starts from nothing" >&2; exit 1; }
  cmake --preset native -B "$folder" -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_COMPILER_LAUNCHER= >/dev/null
  start=$(date +%s)
  full=$(processor_time cmake --build "$folder" -j2)
  wall=$(($(date +%s) - start))
fi
printf '{"compiler": "%s", "public_headers": %d, "whole_interface_s": %s, "typical_unit_s": %s, "full_build_s": %s, "full_build_wall_s": %s}\n' \
  "$("$compiler" --version | head -1)" "$headers" "$everything" "$typical" "$full" "$wall"
