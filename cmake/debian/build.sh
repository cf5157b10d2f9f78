#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Builds the packages of Debian for this system, and lets lintian look at them.
#
#   cmake/debian/build.sh FOLDER
#   cmake/platforms/inside.sh trixie FOLDER --with dpkg-dev --with lintian cmake/debian/build.sh /output
#
# FOLDER receives them; the second form makes those of another Debian, in a bare system. Wants what
# examples/quickstart.sh installs, dpkg-dev and lintian; tetwarp-doc is made where docs/build.sh has its programs. nanobind, with which the module of Python is made, comes from the package index.
# Their date is SOURCE_DATE_EPOCH, by default that of the last commit.
set -euo pipefail
[ $# = 1 ] || { sed -n '5,13p' "$0" | sed 's/^# \{0,1\}//'; exit 2; }
mkdir -p "$1"
folder=$(cd "$1" && pwd)
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
for program in dpkg-shlibdeps lintian; do
  command -v $program >/dev/null || { echo "build.sh: error: $program is not installed; apt-get install dpkg-dev lintian" >&2; exit 1; }
done
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)}
umask 022
if command -v doxygen >/dev/null && command -v sphinx-build >/dev/null; then
  docs/build.sh
else
  echo "build.sh: no doxygen or no sphinx-build, so there is no tetwarp-doc" >&2
  rm -rf build/docs/html
fi
environment=build/debian-venv
[ -x $environment/bin/python ] || /usr/bin/python3 -m venv $environment  # Debian's, for which the package is
$environment/bin/pip install -q nanobind
cmake --preset debian -DPython_EXECUTABLE="$PWD/$environment/bin/python"
cmake --build --preset debian --parallel "${TETWARP_JOBS:-$(nproc)}"
rm -rf build/debian/packages
(cd build/debian && cpack -G DEB -B packages >cpack.log) || { cat build/debian/cpack.log; exit 1; }
rm -f "$folder"/*tetwarp*_*.deb
cp build/debian/packages/*.deb "$folder"
ls -l "$folder"/*.deb
lintian --fail-on error,warning --suppress-tags initial-upload-closes-no-bugs build/debian/packages/*.deb
