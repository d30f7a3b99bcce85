#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Bytes and milliseconds against quality, of models side by side: bakes each to several targets and charts all.
#   samples/curve.sh OUT_DIR MODEL...      a MODEL is a folder of a trainer or a .gsc file; gsc is found in PATH
# The chart of convert/bake/README.md: samples/curve.sh out fox_scaffold boruszyn_scaffold; cp out/figures/curve-quality.svg samples/curve.svg
set -euo pipefail
[ $# -ge 2 ] || { echo "usage: samples/curve.sh OUT_DIR MODEL..." >&2; exit 1; }
out=$1
shift
mkdir -p "$out"
curves=()
for model in "$@"; do
    curve=$out/$(basename "$model" .gsc).jsonl
    [ -e "$curve" ] || gsc bake "$model" --curve 60,55,50,45,40 -o "$curve"
    curves+=("$curve")
done
gsc chart "${curves[@]}" -o "$out/curve.html" --figures "$out/figures" -w
