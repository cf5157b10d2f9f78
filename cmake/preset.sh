#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Prints the preset for this machine: cuda where nvcc is found, else cpu.
#
#   cmake/preset.sh            the preset that users build
#   cmake/preset.sh --built    the preset that was built last: that one, or its ci- form (warnings are errors); if neither
#                              was built, that one
#
# TETWARP_PRESET decides instead where it is set.
set -euo pipefail
build=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)/build
if [ -n "${TETWARP_PRESET:-}" ]; then
  echo "$TETWARP_PRESET"
  exit
elif command -v nvcc >/dev/null 2>&1; then
  preset=cuda
else
  [ "${1:-}" = --built ] || echo "no nvcc found: CPU only" >&2
  preset=cpu
fi
# Ninja writes its log while it builds. -nt is true as well where only the first file is there.
if [ "${1:-}" = --built ] && [ "$build/ci-$preset/.ninja_log" -nt "$build/$preset/.ninja_log" ]; then
  preset=ci-$preset
fi
echo "$preset"
