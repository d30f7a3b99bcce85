#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# From nothing to pictures; its help is below.
set -euo pipefail

usage() {
    cat <<'TEXT'
usage: ./demo.sh [--with PART[,PART...]] [MODEL]
Installs what is missing, builds gsc and gsc-play, converts a trained model,
validates and plays it. Pictures and the .gsc file lie in out/ at the end.
  MODEL         a model folder of Scaffold-GS or Octree-GS; without it a
                sample made on the spot
  --with PARTS  more than the pictures of the demo need, separated by commas:
                  window   gsc-play window, a window to fly in
                  headset  gsc-play xr, through OpenXR
                  figures  gsc chart --figures, charts as SVG and PNG
                  images   EXR, JPEG and WebP; other kinds are read
                  mpi      gsc-play-mpi, for the GPUs of several machines
                A part whose libraries are here already is built without it.
Compiled for the GPU of this machine; without one, without CUDA.
CMAKE_CUDA_ARCHITECTURES=90 ./demo.sh compiles for other GPUs, here for 9.0.
TEXT
}

parts=()
model=
while [ $# -gt 0 ]; do
    case $1 in
    -h | --help)
        usage
        exit 0
        ;;
    --with)
        [ $# -gt 1 ] || { echo "demo: --with lacks its parts, such as --with window,images" >&2; exit 2; }
        IFS=, read -ra parts <<<"$2"
        shift
        ;;
    --with=*) IFS=, read -ra parts <<<"${1#--with=}" ;;
    -*)
        echo "demo: there is no option $1; ./demo.sh --help lists them" >&2
        exit 2
        ;;
    *) model=$1 ;;
    esac
    shift
done
[ -z "$model" ] || model=$(realpath -e -- "$model")
cd "$(dirname "$0")"

step() { printf '\n== %s\n' "$*"; }

step "set-up and build"
.ci/build.sh "${parts[@]}"
gsc=build/release/bin/gsc
play=build/release/player/gsc-play

if [ -z "$model" ]; then
    mkdir -p out/demo
    model=out/demo/model
    step "gsc sample: a city in the layout a trainer leaves"
    "$gsc" sample city --anchors 300k --model octree -o "$model" -w
    file=out/demo/city.gsc
    pictures=out/demo/pictures
else
    name=$(basename "$model")
    mkdir -p "out/$name"
    file=out/$name/$name.gsc
    pictures=out/$name/pictures
fi

step "gsc convert"
"$gsc" convert "$model" -o "$file" -w
step "gsc validate (silent: the file is good)"
"$gsc" validate "$file"
step "gsc info"
"$gsc" info "$file"
step "gsc-play: the first cameras stored in the file"
mkdir -p "$pictures"
"$play" "$file" --frames 0:6 --tier exact --out "$pictures/{frame:03}_{name}.png" -w

printf '\nThe pictures:\n'
find "$PWD/$pictures" -name '*.png' | sort
printf '\nGo on with:\n'
echo "export PATH=\"$PWD/build/release/bin:$PWD/build/release/player:\$PATH\""
if [ -e build/release/lib/gsc/gsc_present.so ]; then
    echo "gsc-play window $(printf %q "$PWD/$file")   # to fly through it, on a desktop"
else
    echo "./demo.sh --with window   # adds a window to fly through it"
fi
