#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds every fuzz target (clang, libFuzzer, ASan, UBSan) and runs each for 40 s.
set -euo pipefail
cd "$(dirname "$0")/.."
cmake --preset fuzz
cmake --build --preset fuzz -j "$(nproc)"
tests/fuzz/run_fuzz.sh 40
