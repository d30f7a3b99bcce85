#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The tables of the GS-Cache paper (arXiv 2502.14938) and its zoom-out figure, from your own models, with the paper's
# figures beside them: reuse none, the paper's rule `depth`, and that with one decode for both eyes, on one GPU; and the
# last of them on several, where there are several.
#   samples/paper.sh CITY.gsc STREET.gsc [OUT]
# gsc and gsc-play are taken from PATH. Environment: BACKEND (auto), SIZE (2048x2048), FRAMES (all of each path), SSIM
# (every 8th frame), MIN_FPS (72) and MAX_FPS (144); LPIPS_BACKBONE and LPIPS_HEADS, the two files of weights that
# `gsc help compare-pictures` names, without which the column of LPIPS is empty. A small run on a CPU:
#   BACKEND=cpu SIZE=128x128 FRAMES=12 samples/paper.sh ...
# Runs that are in OUT (out/paper) already are not repeated; remove it after a change.
set -euo pipefail
if [ $# -lt 2 ] || [ $# -gt 3 ]; then
    echo "paper: needs two models: $0 CITY.gsc STREET.gsc [OUT]" >&2
    exit 1
fi
city=$(realpath -e -- "$1")
street=$(realpath -e -- "$2")
out=${3:-out/paper}
backend=${BACKEND:-auto}
size=${SIZE:-2048x2048}
frames=${FRAMES:-null}
ssim=${SSIM:-8}
each=$ssim # frame that LPIPS is computed for
[ "$each" -gt 0 ] || each=8
tables=$(dirname "$0")/paper_tables.py
mkdir -p "$out"

# the devices that draw together
if [ "${LPIPS_BACKBONE:+1}" != "${LPIPS_HEADS:+1}" ]; then
    echo "paper: LPIPS needs both LPIPS_BACKBONE and LPIPS_HEADS; set the other one too" >&2
    exit 1
fi
count=$(gsc-play --list-devices | grep -c '^cuda:' || true)
gpus=all
if [ "$backend" = cpu ]; then
    count=2
    gpus=cpu:2
fi

# Draws every frame of a path in order, as the sweep does, and keeps each SSIM-th: draw MODEL CAMERAS FOLDER OPTIONS
draw() {
    local model=$1 cameras=$2 folder=$3 frame
    shift 3
    gsc-play "$model" --cameras "$cameras" --backend "$backend" --eyes 2 --size "$size" ${FRAMES:+--frames "0:$FRAMES"} \
        --out "$folder/{frame:05}_{eye}.pfm" --progress plain "$@" >/dev/null
    for frame in "$folder"/*.pfm; do
        local number=${frame##*/}
        [ $((10#${number%%_*} % each)) -eq 0 ] || rm "$frame"
    done
}

# LPIPS of the sweep's runs against exact, on the first path: lpips MODEL CAMERAS SCENE
lpips() {
    local model=$1 cameras=$2 to=$out/$3.lpips pictures=$out/$3.pictures run options
    [ ! -e "$to.merged_depth.json" ] || return 0
    rm -rf "$pictures"
    draw "$model" "$cameras" "$pictures/exact" --tier exact
    for run in none depth merged_depth; do
        case $run in
        none) options= ;;
        depth) options='--reuse depth' ;;
        merged_depth) options='--reuse depth --stereo merged' ;;
        esac
        # shellcheck disable=SC2086 # several words
        draw "$model" "$cameras" "$pictures/$run" $options
        gsc compare-pictures "$pictures/exact" "$pictures/$run" --lpips-backbone "$LPIPS_BACKBONE" \
            --lpips-heads "$LPIPS_HEADS" --format json --progress plain >"$to.new"
        mv "$to.new" "$to.$run.json"
        rm -r "${pictures:?}/$run"
    done
    rm -r "$pictures"
}

for scene in city street; do
    folder=$out/$scene
    case $scene in
    city) model=$city paths='aerial zoom_out' ;;
    street) model=$street paths='walk' ;;
    esac
    if [ ! -d "$folder" ]; then
        # a city that was not photographed from the air has no aerial path: a walk stands for it
        gsc sample paths "$model" -o "$folder" --only "${paths// /,}" -q >/dev/null 2>&1 ||
            gsc sample paths "$model" -o "$folder" --only walk,zoom_out -q >/dev/null
    fi
    list=
    for path in $paths; do
        [ -e "$folder/$path.json" ] || path=walk
        list+="${list:+, }\"$path.json\""
    done
    cat >"$folder/sweep.json.new" <<END
{ "schema": "gsc.sweep/1", "trajectories": [$list], "size": [${size/x/, }], "eyes": 2, "frames": $frames, "warmup": 0,
  "quality": { "ssim": $ssim },
  "runs": [{ "policy": "none" }, { "policy": "depth", "max_depth": 10 },
           { "policy": "depth", "max_depth": 10, "stereo": "merged" }] }
END
    mv "$folder/sweep.json.new" "$folder/sweep.json"
    gsc-play bench "$model" --backend "$backend" --sweep "$folder/sweep.json" --out "$out/$scene.jsonl" \
        --label "$scene" --progress plain >/dev/null
    gsc info "$model" --format json >"$out/$scene.info.json"

    path=${list%%,*}
    [ -z "${LPIPS_HEADS:-}" ] || lpips "$model" "$folder/$(echo "$path" | tr -d '"')" "$scene"
    [ -e "$out/$scene.elastic.json" ] || [ "$count" -lt 2 ] || {
        gsc-play bench "$model" --cameras "$folder/$(echo "$path" | tr -d '"')" --eyes 2 --size "$size" --stereo merged \
            --reuse depth --gpus "$gpus" --frames-in-flight $((3 * count)) --min-fps "${MIN_FPS:-72}" \
            --max-fps "${MAX_FPS:-144}" --warmup 0 --measure "${FRAMES:-300}" --format json >"$out/$scene.new"
        mv "$out/$scene.new" "$out/$scene.elastic.json"
    }
done

# the elastic loop on the zoom-out path, in real time
[ -e "$out/zoom_out.elastic.json" ] || [ "$count" -lt 2 ] || {
    gsc-play live "$city" --cameras "$out/city/zoom_out.json" --eyes 2 --size "$size" --stereo merged --reuse depth \
        --gpus "$gpus" ${FRAMES:+--frames "0:$FRAMES"} --rate "${MAX_FPS:-144}" --min-fps "${MIN_FPS:-72}" \
        --max-fps "${MAX_FPS:-144}" --trace "$out/zoom_out.new" -w --progress plain >/dev/null
    mv "$out/zoom_out.new" "$out/zoom_out.elastic.json"
}

gsc chart "$out/city.jsonl" "$out/street.jsonl" -o "$out/paper.html" -w -q
python3 "$tables" "$out"
printf '\nevery run as a chart: %s\n' "$out/paper.html"
