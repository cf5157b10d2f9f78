#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Makes a bare system of Debian in a folder (debootstrap), unless one was made there before.
#
#   cmake/platforms/bare_system.sh FOLDER SUITE [PACKAGE...]
#
# It has what no system is without, ca-certificates, and PACKAGE. Wants root and the Debian package debootstrap.
set -euo pipefail
[ $# -ge 2 ] || { sed -n '5,9p' "$0" | sed 's/^# \{0,1\}//'; exit 2; }
folder=$1 suite=$2
shift 2
[ ! -f "$folder/complete" ] || exit 0
for needed in debootstrap mount; do
  command -v $needed >/dev/null || { echo "bare_system.sh: error: $needed is not installed" >&2; exit 1; }
done
[ "$(id -u)" = 0 ] || { echo "bare_system.sh: error: this wants root" >&2; exit 1; }
mkdir -p "$folder"
packages=$(IFS=,; echo "ca-certificates${*:+,$*}")
debootstrap --variant=minbase --include="$packages" "$suite" "$folder" >"$folder.log" || { tail -20 "$folder.log" >&2; exit 1; }
if [ -f /etc/apt/sources.list.d/debian.sources ] && grep -q "VERSION_CODENAME=$suite" /etc/os-release; then
  cp /etc/apt/sources.list.d/debian.sources "$folder/etc/apt/sources.list.d/"  # security updates, too
  rm -f "$folder/etc/apt/sources.list"
fi
rm "$folder.log"
touch "$folder/complete"
