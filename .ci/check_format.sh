#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Fails if clang-format 14 would change a source file; names the files.
set -euo pipefail
cd "$(dirname "$0")/.."
mapfile -t files < <(find convert format kernels player runtime tests -name '*.h' -o -name '*.cpp' -o -name '*.cu' -o -name '*.cuh' | sort)
clang-format-14 --dry-run -Werror "${files[@]}"
echo "${#files[@]} files are formatted"
