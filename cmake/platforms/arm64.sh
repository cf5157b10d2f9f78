#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Builds Tetwarp for ARM64 on another machine of Debian 12, and compares the bits that it gives under an emulator
# (tests/bits), of which it keeps a record, in docs/reference/platforms.md. Without ITK, VTK and CUDA.
#
#   cmake/platforms/arm64.sh [OPTIONS OF tests/bits/check.py]
#
# Without precompiled headers, with which Debian 12's cross compiler ends at the vectors of SVE (an internal error).
# Wants the Debian packages g++-aarch64-linux-gnu qemu-user-static debootstrap. The libraries of ARM64 are unpacked into
# build/arm64-sysroot, where none of them is installed or run. TETWARP_JOBS: default all cores.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source cmake/platforms/record.sh
sysroot=$PWD/build/arm64-sysroot
packages=libstdc++-12-dev,libtbb-dev,libhwy-dev,libeigen3-dev,libglm-dev,libgtest-dev,libcli11-dev,nlohmann-json3-dev,libdcmtk-dev,libopenjp2-7-dev,libdeflate-dev,libminizip-dev,libicu-dev,libpng-dev,zlib1g-dev,libssl-dev,libturbojpeg0-dev,libboost1.74-dev
for program in aarch64-linux-gnu-g++ qemu-aarch64-static debootstrap; do
  command -v $program >/dev/null || { echo "arm64.sh: error: $program is not installed" >&2; exit 1; }
done
if [ ! -f "$sysroot/complete" ]; then
  scratch=$(mktemp -d)
  trap 'rm -rf "$scratch"' EXIT
  # Only the choice and the download of packages are debootstrap's.
  debootstrap --arch=arm64 --foreign --variant=minbase --include=$packages bookworm "$scratch/system" >"$scratch/log" ||
    { tail -20 "$scratch/log" >&2; exit 1; }
  rm -rf "$sysroot"
  mkdir -p "$sysroot"
  for package in "$scratch"/system/var/cache/apt/archives/*.deb; do dpkg -x "$package" "$sysroot"; done
  touch "$sysroot/complete"
fi
cmake --preset arm64
cmake --build --preset arm64 --parallel "${TETWARP_JOBS:-$(nproc)}"
file -b build/arm64/apps/tetwarp | cut -d, -f1-2
DCMDICTPATH=$(find "$sysroot/usr/share" -name dicom.dic | head -1)
export DCMDICTPATH
record_bits arm64 "libraries of Debian 12, aarch64 (NEON) under $(qemu-aarch64-static --version | head -1)" \
  "$(aarch64-linux-gnu-g++ --version | head -1)" "without ITK and VTK; cross compiled" "$(head_commit)" \
  build/arm64/apps/tetwarp --launcher "qemu-aarch64-static -L $sysroot" "$@"
