#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The pictures of a camera file, split over processes of this machine (or others: PARALLEL='--sshloginfile FILE'), and
# their lines joined:
#   gnu_parallel.sh SHARDS CITY.gsc CAMERAS.json OUT [OPTIONS OF GSC-PLAY]
# Started again after it was stopped, it goes on where each shard was.
set -euo pipefail
if [ $# -lt 4 ]; then
    echo "gnu_parallel: needs four words: $0 SHARDS CITY.gsc CAMERAS.json OUT" >&2
    exit 1
fi
shards=$1 model=$2 cameras=$3 out=$4
shift 4

mkdir -p "$out"
# --retries: a shard that was killed goes on; {} is its number
seq "$shards" | parallel --quote --jobs "$shards" --retries 3 \
    gsc-play "$model" --cameras "$cameras" --threads 1 --progress none \
    --out "$out/{frame:05}.png" --stats "$out/shard_{}.jsonl" --shard "{}/$shards" "$@" || {
    echo "gnu_parallel: some shards failed, see above; the same command goes on where they were" >&2
    exit 2
}
gsc merge-runs "$out"/shard_*.jsonl -o "$out/frames.jsonl" -w
