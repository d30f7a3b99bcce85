#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The tests with the label cpu, but not those with the label slow, under ASan and UBSan, warnings as errors.
set -euo pipefail
cd "$(dirname "$0")/.."
cmake --preset dev -DGSC_CI_TESTS=OFF
cmake --build --preset dev -j "$(nproc)"
ctest --preset dev -j "$(nproc)" -L cpu -LE slow
