#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Fuzzes the readers, each target for a time, one after the other, on one thread.
#
#   tests/fuzz/run.sh [SECONDS] [TARGET ...]      # default: 1800, all targets
#
# Builds the preset fuzz (Debian 12: clang). A target begins with its corpus (tests/fuzz/corpus/TARGET); inputs that reach
# something new are merged into it, edge by edge. What was found lies in build/fuzz/runs/TARGET: one file that crashes,
# leaks, takes 10 s or asks for 256 MiB at once, and the log. Each target adds a line to build/fuzz/runs/record.md.
# Exit status: 1 if a target found something, which then ends that target's run.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
source_dir=$(cd "$here/../.." && pwd)
bin="$source_dir/build/fuzz/tests/fuzz"
runs="$source_dir/build/fuzz/runs"
record="$runs/record.md"
seconds=${1:-1800}
[ $# -eq 0 ] || shift

cd "$source_dir"
[ -f build/fuzz/CMakeCache.txt ] || cmake --preset fuzz
cmake --build --preset fuzz
targets=("$@")
if [ ${#targets[@]} -eq 0 ]; then
  for corpus in "$here"/corpus/*/; do targets+=("$(basename "$corpus")"); done
fi

# The files that readers are given lie in memory where that is possible.
memory=/dev/shm
[ -w "$memory" ] || memory=${TMPDIR:-/tmp}
TMPDIR=$(mktemp -d "$memory/tetwarp-fuzz.XXXXXX")
export TMPDIR
trap 'rm -rf "$TMPDIR"' EXIT

mkdir -p "$runs"
if [ ! -f "$record" ]; then
  printf '| target | seconds | executions | new files | files in the corpus | found |\n| --- | --- | --- | --- | --- | --- |\n' >"$record"
fi

status=0
for target in "${targets[@]}"; do
  corpus="$here/corpus/$target"
  found="$runs/$target"
  new="$TMPDIR/new-$target"
  mkdir -p "$found" "$new" "$corpus"
  options=(-timeout=10 -rss_limit_mb=2048 -malloc_limit_mb=256 -max_len=12288 -close_fd_mask=1)
  result=nothing
  SECONDS=0
  if ! "$bin/fuzz-$target" "${options[@]}" -max_total_time="$seconds" -print_final_stats=1 \
      -artifact_prefix="$found/" "$new" "$corpus" >"$found/log" 2>&1; then
    result=$(grep -m 1 -o 'SUMMARY: .*' "$found/log" || echo "see $found/log")
    status=1
  fi
  took=$SECONDS
  executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$found/log")
  before=$(find "$corpus" -type f | wc -l)
  "$bin/fuzz-$target" "${options[@]}" -merge=1 -use_counters=0 "$corpus" "$new" >"$found/merge.log" 2>&1 || true
  after=$(find "$corpus" -type f | wc -l)
  echo "| $target | $took | ${executions:-?} | $((after - before)) | $after | $result |" | tee -a "$record"
done
exit $status
