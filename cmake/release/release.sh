#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Makes a release of the last commit: source archive, packages of Debian, wheels, the documents as a site, a bill of
# materials (SPDX), what changed, checksums, and the tag. docs/guide/release.md says what to do before and after.
#
#   cmake/release/release.sh FOLDER [--no-tag] [--twice] [--python PROGRAM]...
#
# FOLDER receives them; it must be empty or not be there yet.
#   --no-tag   makes no tag: a trial
#   --twice    makes all a second time in a folder whose name has another length, and compares the bytes
#   --python   whose wheels are made; may be repeated. Default: those that python/wheels.sh finds
# Wants what examples/quickstart.sh installs, dpkg-dev, lintian, and what docs/build.sh wants. All is made of a clone, so that
# nothing gets in that is not committed, on the CPU alone. Its date is that of the commit (SOURCE_DATE_EPOCH).
set -euo pipefail
usage() { sed -n '5,15p' "$0" | sed 's/^# \{0,1\}//'; exit 2; }
fail() { echo "release.sh: error: $*" >&2; exit 1; }
folder='' tag=yes twice=no pythons=()
while [ $# -gt 0 ]; do
  case $1 in
    --no-tag) tag=no ;;
    --twice) twice=yes ;;
    --python) [ $# -ge 2 ] || usage; pythons+=("$2"); shift ;;
    -*) usage ;;
    *) [ -z "$folder" ] || usage; folder=$1 ;;
  esac
  shift
done
[ -n "$folder" ] || usage
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
[ -z "$(ls -A "$folder")" ] || fail "$folder is not empty"
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source_dir=$PWD

# What has to be true before anything is made.
version=$(sed -n 's/^project(tetwarp VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
name=tetwarp-$version
[ -z "$(git status --porcelain)" ] || fail "there are changes that are not committed"
grep -q "^version: $version\$" CITATION.cff || fail "CITATION.cff does not name version $version, as CMakeLists.txt does"
changes=$(awk -v head="## [$version]" 'index($0, "## [") == 1 { on = index($0, head) == 1 } on' CHANGELOG.md)
grep -qE "^## \[$version\] - [0-9]{4}-[0-9]{2}-[0-9]{2}\$" <<<"$changes" || fail "CHANGELOG.md has no section '## [$version] - DATE'"
[ $tag = no ] || ! git rev-parse -q --verify "refs/tags/v$version" >/dev/null || fail "the tag v$version is there already"
for python in ${pythons[@]+"${pythons[@]}"}; do command -v "$python" >/dev/null || fail "$python is no program"; done
for program in doxygen sphinx-build dpkg-shlibdeps lintian xz; do
  command -v $program >/dev/null || fail "$program is not installed; docs/guide/release.md names the packages"
done
# Before anything is built, since the bill of materials comes last.
read -ra needed <<<"$(examples/quickstart.sh --packages | tr ' ' '\n' | grep '^lib.*-dev$' | tr '\n' ' ')"
cmake/release/sbom.py --check "${needed[@]}"
commit=$(git rev-parse HEAD)
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct "$commit")
export SOURCE_DATE_EPOCH
umask 022

# archive_of FOLDER NAME: a tar.xz of a folder, as NAME, whose bytes are those of the files alone.
archive_of() {
  tar --sort=name --mtime="@$SOURCE_DATE_EPOCH" --owner=0 --group=0 --numeric-owner --format=gnu --transform "s,^\.,$2," -C "$1" -c . |
    xz -9 -T1
}

# make_all CLONE OUTPUT: clones the sources into the folder CLONE, and makes all files but the checksums.
make_all() {
  local clone=$1 out=$2
  mkdir -p "$out"
  git clone -q "$source_dir" "$clone"
  git -C "$clone" checkout -q "$commit"
  echo "== source archive"
  git -C "$clone" archive --format=tar --prefix="$name/" HEAD | xz -9 -T1 >"$out/$name.tar.xz"
  echo "== packages of Debian, and the documents"
  "$clone/cmake/debian/build.sh" "$out"
  archive_of "$clone/build/docs/html" "$name-docs" >"$out/$name-docs.tar.xz"
  echo "== wheels"
  "$clone/python/wheels.sh" --cpu "$out" ${pythons[@]+"${pythons[@]}"}
  echo "== bill of materials"
  "$clone/cmake/release/sbom.py" "$clone" "$out" >"$out/$name.spdx.json"
  printf '%s\n' "$changes" >"$out/$name-changes.md"
}

scratch=$(mktemp -d)
finish() {  # what was built stays where something failed
  if [ $? = 0 ]; then rm -rf "$scratch"; else echo "release.sh: what was built is in $scratch" >&2; fi
}
trap finish EXIT
make_all "$scratch/source" "$folder"
status=0
if [ $twice = yes ]; then
  echo "== all a second time"
  CCACHE_DISABLE=1 make_all "$scratch/another-folder/of-the-sources" "$scratch/again"
  diff <(ls "$folder") <(ls "$scratch/again") || { echo "release.sh: error: other files the second time" >&2; status=1; }
  for path in "$folder"/*; do
    file=$(basename "$path")
    [ -e "$scratch/again/$file" ] || continue
    if cmp -s "$path" "$scratch/again/$file"; then
      echo "same bytes: $file"
    else
      echo "release.sh: error: other bytes the second time: $file" >&2
      mkdir -p "$folder/again"
      cp "$scratch/again/$file" "$folder/again/"
      status=1
    fi
  done
fi
[ $status = 0 ] || exit $status
(cd "$folder" && sha256sum -- * >SHA256SUMS && sha256sum -c --quiet SHA256SUMS && cat SHA256SUMS)
if [ $tag = yes ]; then
  git tag -a "v$version" -m "Tetwarp $version" "$commit"
  echo "tagged: v$version is $commit"
fi
