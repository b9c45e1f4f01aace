#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# check.sh BUILD CONSUMER SCRATCH: what is installed from BUILD works at another place than the one
# it was installed to, for a program of ours and for a project built on the libraries.
set -euo pipefail
build=$1 consumer=$2 scratch=$3

rm -rf "$scratch"
mkdir -p "$scratch"
cmake --install "$build" --prefix "$scratch/first" >"$scratch/install.log"
mv "$scratch/first" "$scratch/prefix"

for program in "$scratch"/prefix/bin/riftmap-*; do
    "$program" --version
done

cmake -G Ninja -S "$consumer" -B "$scratch/build" -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_PREFIX_PATH="$scratch/prefix" >"$scratch/configure.log" 2>&1 || {
    cat "$scratch/configure.log"
    exit 1
}
cmake --build "$scratch/build"
"$scratch/build/consumer"
if ldd "$scratch/build/consumer" "$scratch"/prefix/bin/riftmap-* | grep -F "$build/lib"; then
    echo "something installed still uses the libraries of the build"
    exit 1
fi
