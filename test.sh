#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds preset release and runs the tests through CTest, but not those with the label long,
# which take minutes each. Options go to ctest, and then choose alone:
#   ./test.sh -L cpu        the tests with that label
#   ./test.sh -R format     the tests whose name matches
#   ./test.sh -L long       those that are left out without options
# Trained models are tested too where GSC_CHECKPOINTS (default: ../shared/checkpoints) holds them.
set -euo pipefail
cd "$(dirname "$0")"

jobs=$(nproc)
options=(-DGSC_CI_TESTS=OFF)
if [ -n "${GSC_CI:-}" ]; then # set by .ci/run
    options=(-DGSC_CI_TESTS=ON -DGSC_WITH_CUDA=AUTO)
    .ci/setup.sh ci
else
    .ci/setup.sh tests
fi
cmake --preset release -DGSC_BUILD_TESTS=ON "${options[@]}" # ./demo.sh leaves tests out, and CUDA where no GPU is
cmake --build --preset release -j "$jobs"
[ $# -gt 0 ] || set -- -LE long
# a shell's `command &` starts with SIGINT ignored, which programs under test would keep so
exec env --default-signal=INT,HUP,TERM ctest --preset release -j "$jobs" "$@"
