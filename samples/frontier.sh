#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The frontier of a city: frame time against PSNR and FLIP of exact, fast, detail 1, 2 and 4, foveation and models that
# were baked, over the path `flight`, all held against exact pictures of the city.
#   samples/frontier.sh CITY.gsc [BAKED.gsc ...]     measures, and draws where gsc can draw
#   samples/frontier.sh --draw ROWS.jsonl ...        draws what was measured elsewhere
# gsc, gsc-play and python3 are taken from PATH. The path is paths/flight.json beside the city or in the folder of its
# name, and else made. Environment: OUT (out/frontier), BACKEND (auto), SIZE (2048x2048), FRAMES (all of the path), WARMUP
# (60: first frames that times leave out), EVERY (7: frames of which one is scored), FLIP (16: scored frames of which one
# has FLIP too; those are what a baked model is scored in). A CPU has no foveation and draws fast as exact, so these are
# left out there, and it starts from SIZE 512x512, FRAMES 120, WARMUP 30 and FLIP 4: two minutes for a sample of
#   gsc sample city --anchors 100k -o city && gsc convert city -o city.gsc && gsc bake city.gsc -o city50.gsc --target-psnr 50
#   samples/frontier.sh city.gsc city50.gsc
# OUT/rows.jsonl holds the rows. Measurements that are in OUT already are not made again; remove them after a change. To
# draw elsewhere the rows of a machine whose gsc has no figures:
#   samples/frontier.sh --draw rows.jsonl && cp out/frontier/figures/flight-accuracy.svg samples/frontier.svg
set -euo pipefail
if [ $# -lt 1 ] || { [ "$1" = --draw ] && [ $# -lt 2 ]; }; then
    echo "usage: $0 CITY.gsc [BAKED.gsc ...] or $0 --draw ROWS.jsonl ..." >&2
    exit 1
fi
out=${OUT:-out/frontier}
mkdir -p "$out"

draw() {
    local code=0 said
    said=$(gsc chart "$@" -o "$out/frontier.html" --figures "$out/figures" -w -q 2>&1) || code=$?
    if [ $code -eq 5 ]; then # a build without figures
        gsc chart "$@" -o "$out/frontier.html" -w -q
        printf 'the page: %s; for its pictures, elsewhere: samples/frontier.sh --draw %s\n' "$out/frontier.html" "$*"
        return
    fi
    [ $code -eq 0 ] || { echo "$said" >&2 && exit $code; }
    printf 'the chart: %s and %s\n' "$out/frontier.html" "$out/figures/flight-accuracy.svg"
}
if [ "$1" = --draw ]; then
    shift
    draw "$@"
    exit
fi

city=$1
shift
rows=$(dirname "$0")/frontier_rows.py
backend=${BACKEND:-auto}
if [ "$backend" = auto ]; then
    backend=cpu
    ! gsc-play --list-devices | grep -q '^cuda:' || backend=cuda
fi
if [ "$backend" = cuda ]; then
    size=${SIZE:-2048x2048} frames=${FRAMES:-null} warmup=${WARMUP:-60} flip=${FLIP:-16} base=fast
    runs='{ "tier": "exact" }, { "tier": "fast" }, { "tier": "fast", "fovea_pixels": 2 },
           { "tier": "fast", "detail": 2, "fovea_pixels": 2 },'
else
    size=${SIZE:-512x512} frames=${FRAMES:-120} warmup=${WARMUP:-30} flip=${FLIP:-4} base=exact
    runs='{ "tier": "exact" },'
fi
every=${EVERY:-7}

path=
for candidate in "${city%.gsc}/paths/flight.json" "$(dirname "$city")/paths/flight.json"; do
    [ -n "$path" ] || [ ! -e "$candidate" ] || path=$candidate
done
if [ -z "$path" ]; then
    path=$out/paths/flight.json
    [ -e "$path" ] || gsc sample paths "$city" -o "$out/paths" --only flight -q >/dev/null
fi
[ -e "$out/flight.json" ] || cp "$path" "$out/flight.json"

# sweep FILE SCORE_EVERY FLIP RUNS: a configuration
sweep() {
    cat >"$1" <<END
{ "schema": "gsc.sweep/1", "trajectories": ["flight.json"], "size": [${size/x/, }], "eyes": 2, "frames": $frames,
  "warmup": $warmup, "score_every": $2, "quality": { "flip": $3 }, "runs": [$4] }
END
}
bench() {
    gsc-play bench "$1" --backend "$backend" --sweep "$2" --out "$3" --progress plain >/dev/null
}
# draw_scored MODEL TIER FOLDER: pictures of the frames that baked models are scored in, each without a past
draw_scored() {
    gsc-play "$1" --cameras "$out/scored.json" --backend "$backend" --eyes 2 --size "$size" --tier "$2" \
        --out "$3/{frame:05}_{eye}.pfm" --progress plain >/dev/null
}

sweep "$out/sweep.json" "$every" "$flip" "$runs { \"tier\": \"fast\", \"detail\": 1 }, { \"tier\": \"fast\", \"detail\": 2 },
           { \"tier\": \"fast\", \"detail\": 4 }"
bench "$city" "$out/sweep.json" "$out/city.jsonl"
cp "$out/city.jsonl" "$out/rows.new"

sweep "$out/baked.json" 1000000 0 "{ \"tier\": \"$base\" }" # its scores would be against itself
python3 "$rows" poses "$out/flight.json" "$frames" $((every * flip)) >"$out/scored.json"
for baked in "$@"; do
    name=$(basename "$baked" .gsc)
    bench "$baked" "$out/baked.json" "$out/$name.times.jsonl"
    if [ ! -e "$out/$name.scores.json" ]; then
        [ -d "$out/exact" ] || { draw_scored "$city" exact "$out/exact.new" && mv "$out/exact.new" "$out/exact"; }
        draw_scored "$baked" "$base" "$out/pictures"
        gsc compare-pictures "$out/exact" "$out/pictures" --format json --progress plain >"$out/scores.new"
        rm -r "$out/pictures"
        mv "$out/scores.new" "$out/$name.scores.json"
    fi
    python3 "$rows" row "$out/city.jsonl" "$out/$name.times.jsonl" "$out/$name.scores.json" $((every * flip)) >>"$out/rows.new"
done
rm -rf "$out/exact"
mv "$out/rows.new" "$out/rows.jsonl"
draw "$out/rows.jsonl"
