#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs the tests of code with several threads under ThreadSanitizer: the renderers, reuse, the service, archives
# and our own thread pool, without TBB, which is not built for it.
set -euo pipefail
cd "$(dirname "$0")/.."
tests=(test_renderer test_reuse test_parallel_threads test_service test_archive)
cmake --preset lean -B build/threads -DCMAKE_BUILD_TYPE=RelWithDebInfo -DGSC_BUILD_TESTS=ON -DGSC_WITH_CUDA=OFF \
    -DGSC_STATIC_RUNTIME=OFF -DGSC_SANITIZE=thread -DGSC_FAST_BUILD=OFF
cmake --build build/threads -j "$(nproc)" --target "${tests[@]}"
ctest --test-dir build/threads --output-on-failure -R "^($(IFS='|'; echo "${tests[*]}"))\$"
