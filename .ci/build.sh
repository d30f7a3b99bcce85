#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing and builds gsc and gsc-play in build/release: for the GPU of this machine, or without CUDA.
# usage: .ci/build.sh [PART...]    parts are those of setup.sh; any other is built where its libraries are found
# Variables of the environment: CMAKE_CUDA_ARCHITECTURES names the GPUs to compile for, such as 90.
set -euo pipefail
cd "$(dirname "$0")/.."
log=build/build.log

fail() {
    tail -n 40 $log >&2
    echo "build: $1; the whole log is $log" >&2
    exit 4
}

# Prints CMake's options for CUDA. cuda.cmake looks for nvcc at the same places.
cuda_options() {
    local nvcc=${CUDACXX:-} names=${CMAKE_CUDA_ARCHITECTURES:-} name
    [ -n "$nvcc" ] || nvcc=$(PATH=$PATH:${CUDA_PATH:-}/bin:${CUDA_HOME:-}/bin:/usr/local/cuda/bin type -P nvcc) || true
    if [ -z "$names" ]; then
        # such as 9.0; one line for each GPU
        names=$(nvidia-smi --query-gpu=compute_cap --format=csv,noheader 2>/dev/null | grep -E '^[0-9]+\.[0-9]+$' | tr -d . | sort -nu) || true
        if [ -z "$names" ]; then
            echo "build: no NVIDIA GPU here: without CUDA (CMAKE_CUDA_ARCHITECTURES=90 ahead of the command compiles it)" >&2
        elif [ -z "$nvcc" ]; then
            echo "build: a GPU is here but no nvcc: without CUDA; install the CUDA toolkit, 12.1 or later" >&2
            names=
        fi
    fi
    if [ -z "$names" ]; then
        echo -DGSC_WITH_CUDA=OFF
        return
    fi
    echo "build: with CUDA for compute capability" $names >&2
    echo "-DGSC_WITH_CUDA=AUTO -DCMAKE_CUDA_ARCHITECTURES=$(echo $names | tr ' ' ';')"
}

# Prints ninja's counter, in a log once every 20 s; other lines are kept in the log of the build.
show_counter() {
    local next=$SECONDS line
    while IFS= read -r line; do
        printf '%s\n' "$line" >&3
        if [[ $line =~ ^(\[[0-9]+/[0-9]+\]) ]] && ((SECONDS >= next)); then
            echo "${BASH_REMATCH[1]}"
            next=$((SECONDS + 20))
        fi
    done 3>>$log
}

.ci/setup.sh "$@"
mkdir -p build
options=(-DGSC_BUILD_TESTS=OFF -DGSC_BUILD_BENCH=OFF)
for part in "$@"; do
    case $part in
    window) options+=(-DGSC_WITH_WINDOW=ON) ;;
    headset) options+=(-DGSC_WITH_XR=ON) ;;
    figures) options+=(-DGSC_WITH_FIGURES=ON) ;;
    images) options+=(-DGSC_WITH_OIIO=ON) ;;
    esac
done
cuda=$(cuda_options)
cmake --preset release $cuda "${options[@]}" >$log 2>&1 || fail "CMake failed"
sed -n 's/^-- gsc: /build: /p' $log
command=(cmake --build --preset release -j "$(nproc)" --target gsc gsc-play gsc_shell_files gsc-play_shell_files)
if [ -t 1 ]; then # ninja counts in place
    "${command[@]}"
else
    "${command[@]}" 2>&1 | show_counter || fail "the build failed"
fi
echo "build: build/release/bin/gsc and build/release/player/gsc-play, in $SECONDS s"
