#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds preset release and runs every test through CTest. Options go to ctest, such as
#   ./test.sh -L cpu        only the tests with that label
#   ./test.sh -R format     only the tests whose name matches
# Trained models are tested too where GSC_CHECKPOINTS (default: ../shared/checkpoints) holds them.
set -euo pipefail
cd "$(dirname "$0")"

jobs=$(nproc)
ci=OFF
if [ -n "${GSC_CI:-}" ]; then # set by .ci/run
    ci=ON
    .ci/setup.sh ci
else
    .ci/setup.sh
fi
cmake --preset release -DGSC_CI_TESTS=$ci
cmake --build --preset release -j "$jobs"
exec ctest --preset release -j "$jobs" "$@"
