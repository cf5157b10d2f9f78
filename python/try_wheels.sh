#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Tries wheels as someone would who has nothing of what they are built with: installs one in a bare system of Debian
# (debootstrap), and runs the tests of the package there.
#
#   python/try_wheels.sh FOLDER [SUITE...]
#
# FOLDER holds what python/wheels.sh made. SUITE: by default bookworm and trixie. Wants root and the Debian package debootstrap.
# TETWARP_CHROOTS names a folder in which the bare systems are kept for the next time.
set -euo pipefail
[ $# -ge 1 ] || { sed -n '5,11p' "$0" | sed 's/^# \{0,1\}//'; exit 2; }
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
wheels=$(cd "$1" && pwd)
shift
suites=("$@")
[ ${#suites[@]} -gt 0 ] || suites=(bookworm trixie)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
chroots=${TETWARP_CHROOTS:-$scratch/chroots}
mkdir -p "$chroots"
for suite in "${suites[@]}"; do
  root=$chroots/python-$suite
  "$source_dir/cmake/platforms/bare_system.sh" "$root" "$suite" python3 python3-venv
  version=$(chroot "$root" python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')
  echo "== $suite, Python $version, $(chroot "$root" dpkg -l | grep -c '^ii') packages"
  if chroot "$root" dpkg -l | grep -E '^ii +(g\+\+|cmake|libdcmtk|libtbb|libhwy|libicu-dev)'; then
    echo "try_wheels.sh: error: $root is not bare" >&2
    exit 1
  fi
  # What the tests want besides; the package itself wants NumPy alone.
  rm -rf "$root/try"
  mkdir -p "$root/try/wheels"
  python3 -m pip download -q -d "$root/try/wheels" --only-binary=:all: --python-version "$version" --implementation cp \
    --abi "cp${version/./}" --abi abi3 --abi none --platform manylinux_2_28_x86_64 --platform manylinux_2_27_x86_64 \
    --platform manylinux_2_17_x86_64 --platform manylinux2014_x86_64 numpy pytest pydicom nibabel
  cp "$wheels"/*.whl "$root/try/wheels"
  mkdir -p "$root/try/python" "$root/try/examples" "$root/try/tests"
  cp -r "$source_dir/python/tests" "$root/try/python"
  cp -r "$source_dir/tests/view" "$source_dir/tests/formats" "$root/try/tests"
  cp -r "$source_dir/examples/scenarios" "$root/try/examples"
  chroot "$root" python3 -m venv /try/venv
  chroot "$root" /try/venv/bin/pip install -q --no-index --find-links /try/wheels tetwarp
  chroot "$root" /try/venv/bin/python -c 'import tetwarp as tw; print(tw.features()); assert tw.features()["viewer"]'
  chroot "$root" /try/venv/bin/pip install -q --no-index --find-links /try/wheels pytest pydicom nibabel
  mount --bind /proc "$root/proc"
  status=0
  chroot "$root" env -u DCMDICTPATH TETWARP_PROGRAM=/try/venv/bin/tetwarp PYTHONDONTWRITEBYTECODE=1 \
    /try/venv/bin/python -m pytest -q -p no:cacheprovider /try/python/tests || status=$?
  umount "$root/proc"
  [ $status = 0 ] || exit $status
done
