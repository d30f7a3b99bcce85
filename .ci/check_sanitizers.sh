#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The tests with the label cpu, but not those with the label slow, under ASan and UBSan, warnings as errors.
# The preset sets intercept_tls_get_addr=0: LeakSanitizer takes the bytes before a thread-local block that glibc
# allocated 16 bytes into a page for its bounds, and crashes ("Tracer caught signal 11") where heap and library meet so.
set -euo pipefail
cd "$(dirname "$0")/.."
cmake --preset dev -DGSC_CI_TESTS=OFF -DGSC_FAST_BUILD=ON # two thirds of the time
cmake --build --preset dev -j "$(nproc)"
ctest --preset dev -j "$(nproc)" -L cpu -LE slow
