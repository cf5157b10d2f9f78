#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Compares the bits of a program on a CUDA device (tests/bits), and keeps a record, in docs/reference/platforms.md.
#
#   cmake/platforms/device.sh PROGRAM
#
# Of several devices the first one. Wants no compiler, but strings: the program may come from another machine.
set -euo pipefail
[ $# = 1 ] || { sed -n '5,9p' "$0" | sed 's/^# \{0,1\}//'; exit 2; }
program=$(realpath "$1")
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source cmake/platforms/record.sh
export CUDA_DEVICE_ORDER=PCI_BUS_ID CUDA_VISIBLE_DEVICES=0  # the first one of nvidia-smi, which otherwise counts in another order
device=$(nvidia-smi -i 0 --query-gpu=name,driver_version --format=csv,noheader | head -1) || { echo "device.sh: error: no device" >&2; exit 1; }
name=${device%,*}
record_bits "$(tr '[:upper:]' '[:lower:]' <<<"$name" | sed 's/[^a-z0-9]\+/-/g')" "$name, driver ${device##*, }; $(system_name)" \
  "$(compiler_of "$program"), nvcc" "--backend cuda" "$(commit_of "$program")" "$program" -- --backend cuda
