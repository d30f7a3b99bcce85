#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs every fuzz target that was built, SECONDS each, and fails on a finding.
#   tests/fuzz/run_fuzz.sh SECONDS [BUILD_DIR]     BUILD_DIR: default build/fuzz (preset `fuzz`)
# Inputs that break a target are kept in BUILD_DIR/fuzz/findings.
set -euo pipefail

seconds=${1:?usage: run_fuzz.sh SECONDS [BUILD_DIR]}
root=$(cd "$(dirname "$0")/../.." && pwd)
folder=${2:-$root/build/fuzz}/fuzz
findings=$folder/findings
mkdir -p "$findings"
corpus=$(mktemp -d)
trap 'rm -rf "$corpus"' EXIT

mapfile -t targets < <(find "$folder" -maxdepth 1 -type f -executable -name 'fuzz_*' | sort)
if [ "${#targets[@]}" -eq 0 ]; then
    echo "run_fuzz.sh: no fuzz targets in $folder; build the preset 'fuzz' first" >&2
    exit 1
fi

run_one() {
    local target=$1 seconds=$2 corpus=$3 findings=$4 name log
    name=$(basename "$target")
    log=$corpus/$name.log
    mkdir -p "$corpus/$name"
    # two gigabytes and ten seconds per input are far beyond what any small input may take
    if "$target" -max_total_time="$seconds" -rss_limit_mb=2048 -malloc_limit_mb=1024 -timeout=10 \
        -seed=1 -print_final_stats=1 -artifact_prefix="$findings/$name-" "$corpus/$name" >"$log" 2>&1; then
        echo "$name: no finding in $seconds s, $(sed -n 's/^stat::number_of_executed_units: *//p' "$log") runs," \
            "$(grep -o 'cov: [0-9]*' "$log" | tail -1)"
    else
        echo "$name: FINDING"
        tail -60 "$log"
        return 1
    fi
}
export -f run_one
export ASAN_OPTIONS=intercept_tls_get_addr=0:${ASAN_OPTIONS:-detect_leaks=1:allocator_may_return_null=0}
export UBSAN_OPTIONS=${UBSAN_OPTIONS:-print_stacktrace=1:halt_on_error=1}

jobs=$(nproc)
[ "$jobs" -gt 4 ] && jobs=4
printf '%s\0' "${targets[@]}" |
    xargs -0 -P "$jobs" -I{} bash -c 'run_one "$@"' run_one {} "$seconds" "$corpus" "$findings"
