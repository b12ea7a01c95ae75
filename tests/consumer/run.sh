#!/usr/bin/env bash
# run.sh BUILD_DIR: installs a finished build into a temporary prefix, then builds and runs
# the consumer against it twice, once through find_package and once through pkg-config.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=$1
temporary=$(mktemp -d)
trap 'rm -rf "$temporary"' EXIT

cmake --install "$build" --prefix "$temporary/prefix" >/dev/null

echo "== find_package"
cmake -G Ninja -S "$here" -B "$temporary/build" -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$temporary/prefix"
cmake --build "$temporary/build"
"$temporary/build/consumer"

echo "== pkg-config"
export PKG_CONFIG_PATH=$(dirname "$(find "$temporary/prefix" -name porthos.pc)")
# shellcheck disable=SC2046,SC2086  # flags are meant to be split
${CXX:-c++} -std=c++20 -O3 ${CXXFLAGS:-} $(pkg-config --cflags porthos) "$here/main.cpp" \
  -o "$temporary/consumer" $(pkg-config --libs porthos)
"$temporary/consumer"
