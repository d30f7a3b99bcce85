#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what the machine lacks, from the distribution (Debian 12, Ubuntu 24.04).
# usage: .ci/setup.sh [--list] [PART...]    --list prints the packages instead
#   without a part   what gsc and gsc-play need to convert, play and write PNG
#   window, headset  gsc-play window; gsc-play xr
#   figures          gsc chart --figures
#   images           EXR, JPEG and WebP, and reading what OpenImageIO reads
#   mpi              gsc-play-mpi
#   tests            what ./test.sh needs, which tests all of the above
#   ci               everything, and the tools of .ci/run: ccache, clang for the fuzz targets, clang-format, and what
#                    tests skip where it is missing: zsh and fish, which complete, man, ffmpeg, what opens a window
#                    without a display, and Chromium with the viewers of tests/viewers, from npm
set -euo pipefail

packages=(
    g++ cmake ninja-build
    libopenvdb-dev libnanovdb-dev libboost-dev libboost-iostreams-dev libtbb-dev
    nlohmann-json3-dev libglm-dev libcli11-dev libhwy-dev libxxhash-dev libzstd-dev zlib1g-dev libdeflate-dev libzip-dev
    libyaml-cpp-dev libwebp-dev
)
is_ci=
only_lists=
if [ "${1:-}" = --list ]; then
    only_lists=1
    shift
fi
parts=("$@")
for ((i = 0; i < ${#parts[@]}; ++i)); do
    case ${parts[i]} in
    window) packages+=(libvulkan-dev libglfw3-dev libimgui-dev pkg-config) ;;
    headset) packages+=(libvulkan-dev libopenxr-dev) ;;
    figures) packages+=(duktape-dev librsvg2-dev pkg-config) ;;
    images) packages+=(libopenimageio-dev) ;;
    archives | sog) ;; # in every set-up
    mpi) packages+=(libopenmpi-dev openmpi-bin) ;;
    tests)
        parts+=(window headset figures images)
        packages+=(doctest-dev libbenchmark-dev binutils openimageio-tools python3 python3-numpy python3-jsonschema)
        ;;
    ci)
        is_ci=1
        parts+=(tests mpi)
        packages+=(ccache clang libclang-rt-dev clang-format-14 zsh fish man-db ffmpeg netpbm
                   xvfb xdotool mesa-vulkan-drivers vulkan-validationlayers)
        command -v npm >/dev/null || packages+=(npm)
        # Ubuntu has it as a snap, which does not run everywhere
        if grep -q '^ID=debian' /etc/os-release 2>/dev/null; then packages+=(chromium); fi
        ;;
    *)
        echo "setup: there is no part ${parts[i]}; expected window, headset, figures, images, mpi, tests or ci" >&2
        exit 2
        ;;
    esac
done

if [ -n "$only_lists" ]; then
    printf '%s\n' "${packages[@]}" | sort -u
    exit 0
fi

# A registry that cannot be reached fails nothing: the tests of viewers are then skipped.
fetch_viewers() {
    cd "$(dirname "$0")/../tests/viewers"
    [ node_modules -nt package-lock.json ] && return
    timeout 180 npm ci --omit=dev --ignore-scripts --no-audit --no-fund --fetch-retries=1 >&2 && touch node_modules ||
        echo "setup: the packages of tests/viewers were not fetched; its tests are skipped" >&2
}

if ! command -v dpkg-query >/dev/null; then
    echo "setup: not a Debian or Ubuntu system; install the equivalents of: ${packages[*]}" >&2
    exit 0
fi

missing=()
for package in $(printf '%s\n' "${packages[@]}" | sort -u); do
    status=$(dpkg-query -W -f='${Status}' "$package" 2>/dev/null || true)
    [ "$status" = "install ok installed" ] || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
    [ -z "$is_ci" ] || fetch_viewers
    exit 0
fi

echo "setup: installing ${missing[*]}" >&2
as_root=()
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { echo "setup: root or sudo is needed to install: ${missing[*]}" >&2; exit 2; }
    as_root=(sudo)
fi
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -q >&2
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}" >&2
[ -z "$is_ci" ] || fetch_viewers
