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

# Sets `cuda` to CMake's options for CUDA.
choose_cuda() {
    local nvcc=${CUDACXX:-} known gpus=() gpu
    cuda=(-DGSC_WITH_CUDA=OFF)
    if [ -n "${CMAKE_CUDA_ARCHITECTURES:-}" ]; then
        cuda=(-DGSC_WITH_CUDA=ON "-DCMAKE_CUDA_ARCHITECTURES=$CMAKE_CUDA_ARCHITECTURES")
        return
    fi
    # such as 9.0, a line for each GPU; kernels/ needs 8.0
    for gpu in $(nvidia-smi --query-gpu=compute_cap --format=csv,noheader 2>/dev/null | grep -xE '[0-9]+\.[0-9]' | tr -d . | sort -nu); do
        ((gpu < 80)) || gpus+=("$gpu")
    done
    if [ ${#gpus[@]} -eq 0 ]; then
        echo "build: without CUDA: no NVIDIA GPU of compute capability 8.0 or later is here (CMAKE_CUDA_ARCHITECTURES=90 ./demo.sh compiles it all the same)"
        return
    fi
    # kernels/cuda.cmake looks at the same places
    [ -n "$nvcc" ] || nvcc=$(PATH=$PATH:${CUDA_PATH:-}/bin:${CUDA_HOME:-}/bin:/usr/local/cuda/bin type -P nvcc) || true
    if [ -z "$nvcc" ]; then
        echo "build: without CUDA: an NVIDIA GPU is here, but no nvcc; the CUDA toolkit has it, 12.1 or later"
        return
    fi
    known=$("$nvcc" --list-gpu-arch) || true
    for gpu in "${!gpus[@]}"; do # the driver compiles code for 9.0 anew for one that is newer than nvcc
        [[ $known == *"compute_${gpus[gpu]}"* ]] || gpus[gpu]=90
    done
    cuda=(-DGSC_WITH_CUDA=AUTO "-DCMAKE_CUDA_ARCHITECTURES=$(IFS=';' && echo "${gpus[*]}")")
    echo "build: with CUDA for compute capability ${gpus[*]}"
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
targets=(gsc gsc-play gsc_shell_files gsc-play_shell_files)
for part in "$@"; do
    case $part in
    window) options+=(-DGSC_WITH_WINDOW=ON) ;;
    headset) options+=(-DGSC_WITH_XR=ON) ;;
    figures) options+=(-DGSC_WITH_FIGURES=ON) ;;
    images) options+=(-DGSC_WITH_OIIO=ON) ;;
    mpi) options+=(-DGSC_WITH_MPI=ON) targets+=(gsc-play-mpi) ;;
    esac
done
choose_cuda
cmake --preset release "${cuda[@]}" "${options[@]}" >$log 2>&1 || fail "CMake failed"
sed -n 's/^-- gsc: /build: /p' $log
command=(cmake --build --preset release -j "$(nproc)" --target "${targets[@]}")
if [ -t 1 ]; then # ninja counts in place, and shows what fails
    "${command[@]}" || exit 4
else
    "${command[@]}" 2>&1 | show_counter || fail "the build failed"
fi
echo "build: build/release/bin/gsc and build/release/player/gsc-play, in $SECONDS s"
