#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Runs the tests of the build that examples/quickstart.sh or .ci/run made, whichever was built last.
#
#   tests/run.sh [--peers] [CTEST ARGUMENTS]
#
# --peers: the Python package is tested beside large libraries, too (tests/python_environment.sh).
# TETWARP_PRESET names another build (CMakePresets.json): cpu on a machine with nvcc, or asan.
# Real series: $TETWARP_TEST_DATA names a folder of unpacked sets; without it, sets packed in ../shared/data are unpacked
# into the build folder. Tests that find no data skip and say so.
set -euo pipefail
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
preset=$("$source_dir/cmake/preset.sh" --built)
if [ ! -f "$source_dir/build/$preset/CTestTestfile.cmake" ]; then
  echo "run.sh: error: no tests in build/$preset; run examples/quickstart.sh, or name another build in TETWARP_PRESET" >&2
  exit 1
fi
echo "== testing build/$preset"
packed="$source_dir/../shared/data"
if [ -z "${TETWARP_TEST_DATA:-}" ] && [ -f "$packed/unpack.sh" ]; then
  export TETWARP_TEST_DATA="$source_dir/build/test-data"
  if [ ! -f "$TETWARP_TEST_DATA/complete" ]; then
    mkdir -p "$TETWARP_TEST_DATA"
    bash "$packed/unpack.sh" "$TETWARP_TEST_DATA" >/dev/null
    touch "$TETWARP_TEST_DATA/complete"
  fi
fi
peers=()
if [ "${1:-}" = --peers ]; then
  peers=(--peers)
  shift
fi
# A module with sanitizers in it is loaded by no ordinary Python.
[ "$preset" = asan ] || "$source_dir/tests/python_environment.sh" "$preset" "${peers[@]}"
cd "$source_dir"
exec ctest --preset "$preset" "$@"
