#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Compares the bits of a program (tests/bits) on older x86-64 processors than this one, under an emulator, and keeps a
# record of each, in docs/reference/platforms.md.
#
#   cmake/platforms/emulated.sh PROGRAM [PROCESSOR...]
#
# PROCESSOR: qemu64 (SSE3), Nehalem (SSE4.2), Haswell (AVX2), by default all; names of qemu's -cpu. Wants c++, strings
# and qemu-x86_64-static of the Debian package qemu-user-static, or what TETWARP_QEMU names. Where the emulator itself gathers wrongly (qemu 7.2 does,
# 10.0 does not; tests/bits/gather_index.cpp), what it gives for a processor with AVX2 says nothing about the program: that is said, and no
# record is made.
set -euo pipefail
[ $# -ge 1 ] || { sed -n '5,14p' "$0" | sed 's/^# \{0,1\}//'; exit 2; }
program=$(realpath "$1")
shift
processors=("$@")
[ ${#processors[@]} -gt 0 ] || processors=(qemu64 Nehalem Haswell)
qemu=${TETWARP_QEMU:-qemu-x86_64-static}
qemu=$(realpath "$(command -v "$qemu")") || { echo "emulated.sh: error: $qemu is not installed; apt-get install qemu-user-static" >&2; exit 1; }
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source cmake/platforms/record.sh
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
c++ -O1 -static tests/bits/gather_index.cpp -o "$scratch/gather_index"
status=0
for processor in "${processors[@]}"; do
  wrong=$("$qemu" -cpu "$processor" "$scratch/gather_index" 2>/dev/null | grep wrong) || true  # nothing where there is no AVX2
  if [ -n "$wrong" ]; then
    echo "emulated.sh: $processor is left out: this emulator gathers wrongly ($wrong)" >&2
    continue
  fi
  record_bits "$(tr '[:upper:]' '[:lower:]' <<<"$processor")" "$(system_name) as $processor under $("$qemu" --version | head -1)" \
    "$(compiler_of "$program")" none "$(commit_of "$program")" "$program" --launcher "$qemu -cpu $processor" || status=1
done
exit $status
