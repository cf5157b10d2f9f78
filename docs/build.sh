#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Builds the documents as a site, build/docs/html/index.html, with the interface of the installed headers. Nothing is
# fetched; docs/guide/install.md names the Debian packages. A warning of Doxygen or Sphinx is an error.
#
#   docs/build.sh [--headers]
#
# --headers: only looks whether Doxygen understands the headers; exit status 77 where it is not installed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=build/docs headers_only=no
[ "${1:-}" != --headers ] || headers_only=yes
[ $headers_only = no ] || command -v doxygen > /dev/null || { echo "doxygen is not installed"; exit 77; }
needed=(doxygen sphinx-build)
[ $headers_only = no ] || needed=(doxygen)
for program in "${needed[@]}"; do
  command -v "$program" > /dev/null ||
    { echo "docs/build.sh: error: $program is not installed; docs/guide/install.md names the packages" >&2; exit 1; }
done
mkdir -p "$out/source" "$out/doxygen"

# Pages as they are, a page of the interface for each library, and one of the Python package.
rm -rf "$out/source"
cp -pR docs "$out/source"
mkdir -p "$out/source/api"
mapfile -t headers < <(python3 docs/api_pages.py "$out/source/api")
python3 docs/python_pages.py "$out/source/api/python.md"

doxygen=0
{ cat docs/Doxyfile; printf 'INPUT = %s\n' "${headers[*]}"; } | doxygen - 2> "$out/doxygen.log" || doxygen=$?
cat "$out/doxygen.log" >&2
warnings=$(grep -cE '(warning|error): ' "$out/doxygen.log" || true)
echo "Doxygen: $warnings warnings ($out/doxygen.log)"
if [ "$doxygen" -ne 0 ]; then
  echo "docs/build.sh: error: Doxygen's warnings are errors; document what it names in the headers" >&2
  exit 1
fi

[ $headers_only = no ] || exit 0
sphinx-build -b html -q -W --keep-going -c docs -d "$out/doctrees" "$out/source" "$out/html"
echo "$out/html/index.html"
