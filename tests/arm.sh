#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Builds the player and tests of the CPU's stages for 64-bit Arm and runs the tests under qemu-user, NEON and all.
#
#   tests/arm.sh [FOLDER]     FOLDER: build/arm
#
# On Debian 12 for x86-64, with g++-12-aarch64-linux-gnu and qemu-user; libraries for Arm are fetched into FOLDER.
set -eu
for program in aarch64-linux-gnu-g++-12 qemu-aarch64; do
    if ! command -v "$program" > /dev/null; then
        echo "arm.sh: found no $program, expected it in PATH; install g++-12-aarch64-linux-gnu and qemu-user" >&2
        exit 1
    fi
done
unset CDPATH
source=$(cd "$(dirname "$0")/.." && pwd)
mkdir -p "${1:-$source/build/arm}"
folder=$(cd "${1:-$source/build/arm}" && pwd)
cd "$source"
libraries=$folder/root/usr/lib/aarch64-linux-gnu
if [ ! -d "$folder/root" ]; then
    packages=$folder/packages
    rm -rf "$packages" "$folder/unpacked"
    mkdir -p "$packages/lists/partial" "$packages/cache/archives/partial"
    arm() {
        apt-get -qq -o APT::Architecture=arm64 -o APT::Architectures=arm64 -o APT::Sandbox::User=root \
            -o Dir::State::Lists="$packages/lists" -o Dir::Cache="$packages/cache" "$@"
    }
    arm update
    (cd "$packages" && arm download libhwy-dev libhwy1 libtbb-dev libtbb12 libtbbmalloc2 libtbbbind-2-5)
    for package in "$packages"/*.deb; do
        dpkg -x "$package" "$folder/unpacked"
    done
    mv "$folder/unpacked" "$folder/root" # only when all is there
    rm -rf "$packages"
fi
cmake --preset lean -B "$folder" -DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR=aarch64 \
    -DCMAKE_C_COMPILER=aarch64-linux-gnu-gcc-12 -DCMAKE_CXX_COMPILER=aarch64-linux-gnu-g++-12 \
    -DCMAKE_CROSSCOMPILING_EMULATOR="qemu-aarch64;-L;/usr/aarch64-linux-gnu;-E;LD_LIBRARY_PATH=$libraries" \
    -DGSC_WITH_CUDA=OFF -DGSC_BUILD_TESTS=ON -Dhwy_DIR="$libraries/cmake/hwy" -DTBB_DIR="$libraries/cmake/TBB"
cmake --build "$folder" --target gsc-play test_kernel_math test_kernel_simd_math test_kernel_simd_support test_kernel_select \
    test_kernel_strip test_kernel_decode test_kernel_sensitivity test_kernel_raster test_kernel_frame test_renderer test_bands test_stereo
ctest --test-dir "$folder" --output-on-failure -R '^test_(kernel_.*|renderer|bands|stereo)$'
