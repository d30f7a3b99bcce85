#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# From nothing to pictures: installs what is missing, builds, takes a trained model, converts, validates, plays it.
#   ./demo.sh                    a sample made on the spot
#   ./demo.sh CHECKPOINT_DIR     a model folder of Scaffold-GS or Octree-GS
set -euo pipefail
model=${1:-}
[ -z "$model" ] || model=$(realpath -e -- "$model")
cd "$(dirname "$0")"

step() { printf '\n== %s\n' "$*"; }

step "set-up and build"
.ci/setup.sh
mkdir -p build out
if ! { cmake --preset release && cmake --build --preset release -j "$(nproc)" --target gsc gsc-play; } >build/demo.log 2>&1; then
    tail -n 40 build/demo.log >&2
    echo "demo: the build failed; the whole log is build/demo.log" >&2
    exit 4
fi
gsc=$(find build/release -name gsc -type f -perm -u+x | head -n 1)
play=$(find build/release -name gsc-play -type f -perm -u+x | head -n 1)

if [ -z "$model" ]; then
    model=out/demo/model
    step "gsc sample: a city in the layout a trainer leaves"
    "$gsc" sample city --anchors 300k --model octree -o "$model" -w
    file=out/demo/city.gsc
    pictures=out/demo/pictures
else
    name=$(basename "$model")
    mkdir -p "out/$name"
    file=out/$name/$name.gsc
    pictures=out/$name/pictures
fi

step "gsc convert"
"$gsc" convert "$model" -o "$file" -w
step "gsc validate (silent: the file is good)"
"$gsc" validate "$file"
step "gsc info"
"$gsc" info "$file"
step "gsc-play: the first cameras stored in the file"
mkdir -p "$pictures"
"$play" "$file" --frames 0:6 --tier exact --out "$pictures/{frame:03}_{name}.png" -w

printf '\nThe pictures:\n'
find "$PWD/$pictures" -name '*.png' | sort
