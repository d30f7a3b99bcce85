#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The pictures of a camera file, split over the tasks of a Slurm job array:
#   sbatch --array=1-8 slurm_array.sh CITY.gsc CAMERAS.json OUT [OPTIONS OF GSC-PLAY]
# A GPU for each task: sbatch --array=1-8 --gres=gpu:1 ... --backend cuda
#SBATCH --job-name=gsc
#SBATCH --output=gsc_%A_%a.log
#SBATCH --open-mode=append
#SBATCH --requeue
set -euo pipefail
if [ $# -lt 3 ] || [ -z "${SLURM_ARRAY_TASK_ID:-}" ]; then
    echo "slurm_array: needs a job array and three words: sbatch --array=1-8 $0 CITY.gsc CAMERAS.json OUT" >&2
    exit 1
fi
model=$1 cameras=$2 out=$3
shift 3

mkdir -p "$out"
# a task that is requeued goes on where it was
exec gsc-play "$model" --cameras "$cameras" --threads "${SLURM_CPUS_PER_TASK:-1}" --progress plain \
    --out "$out/{frame:05}.png" --stats "$out/shard_$SLURM_ARRAY_TASK_ID.jsonl" --shard auto "$@"
