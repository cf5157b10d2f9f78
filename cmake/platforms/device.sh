#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Compares the bits of a program on a CUDA device (tests/bits), and keeps a record, in docs/reference/platforms.md.
#
#   cmake/platforms/device.sh PROGRAM
#
# Wants no compiler: the program may come from another machine.
set -euo pipefail
[ $# = 1 ] || { sed -n '5,9p' "$0" | sed 's/^# \{0,1\}//'; exit 2; }
program=$(realpath "$1")
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source cmake/platforms/record.sh
device=$(nvidia-smi --query-gpu=name,driver_version --format=csv,noheader | head -1) || { echo "device.sh: error: no device" >&2; exit 1; }
name=${device%,*}
record_bits "$(tr '[:upper:] ' '[:lower:]-' <<<"$name" | cut -d- -f1,2)" "$name, driver ${device##*, }; $(system_name)" \
  "$(compiler_of "$program"), nvcc" "--backend cuda" "$(commit_of "$program")" "$program" -- --backend cuda
