#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# From nothing to the chart of README: installs what is missing, builds, takes a trained model, makes camera paths for
# it, plays them with every reuse policy of samples/sweeps/reuse.json and draws speed against accuracy.
#   samples/chart.sh                    a sample made on the spot
#   samples/chart.sh CHECKPOINT_DIR     a model folder of Scaffold-GS or Octree-GS
# Runs that are in out/chart/NAME/runs.jsonl already are not repeated; delete the file after a change.
set -euo pipefail
model=${1:-}
[ -z "$model" ] || model=$(realpath -e -- "$model")
cd "$(dirname "$0")/.."

step() { printf '\n== %s\n' "$*"; }

step "set-up and build"
.ci/build.sh figures
gsc=build/release/bin/gsc
play=build/release/player/gsc-play

name=city
[ -z "$model" ] || name=$(basename "$model")
folder=out/chart/$name
mkdir -p "$folder"
if [ -z "$model" ]; then
    model=$folder/model
    step "gsc sample: a city in the layout a trainer leaves"
    "$gsc" sample city --anchors 100k -o "$model" -w
fi

step "gsc convert"
"$gsc" convert "$model" -o "$folder/$name.gsc" -w
step "gsc sample paths: cameras at the pace of a viewer"
"$gsc" sample paths "$folder/$name.gsc" -o "$folder/paths" -w
step "gsc-play bench --sweep: every policy on every path, against exact"
cp samples/sweeps/reuse.json "$folder/sweep.json"
"$play" bench "$folder/$name.gsc" --backend cpu --sweep "$folder/sweep.json" --out "$folder/runs.jsonl"
step "gsc chart"
"$gsc" chart "$folder/runs.jsonl" -o "$folder/chart.html" --figures "$folder/figures" -w

printf '\nThe chart:\n%s\n' "$PWD/$folder/chart.html"
find "$PWD/$folder/figures" -name '*.png' | sort
