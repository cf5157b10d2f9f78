#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Installs the packages of examples/quickstart.sh, and those that are named, and builds nothing. For workflows, as root.
#
#   .github/install-packages.sh [PACKAGE ...]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
list=$(sed -n '/^packages=($/,/^)$/p' examples/quickstart.sh)
[ -n "$list" ] || { echo "install-packages.sh: error: no list of packages in examples/quickstart.sh" >&2; exit 1; }
packages=()
eval "$list"
export DEBIAN_FRONTEND=noninteractive
apt-get update -qq
apt-get install -y -qq --no-install-recommends "${packages[@]}" "$@"
