#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Names the packages of Debian or Ubuntu that an installation needs to run, one a line: those that own the shared
# libraries which its programs and modules load, and DCMTK's dictionary where DCMTK is among them.
#
#   cmake/containers/needed.sh FOLDER
#
# FOLDER holds the installation (DESTDIR). It runs on the system that built it. A library that is not found, or that no
# package owns, is an error.
set -euo pipefail
[[ $# = 1 && -d $1 ]] || { sed -n '5,11p' "$0" | sed 's/^# \{0,1\}//'; exit 2; }
folder=$(cd "$1" && pwd -P)

programs() {  # the ELF files
  local file
  find "$folder" -type f -print0 | while IFS= read -r -d '' file; do
    if head -c 4 "$file" | LC_ALL=C grep -q ELF; then printf '%s\n' "$file"; fi
  done
}

# owner FILE: the package that owns it. The loader may name /lib what dpkg names /usr/lib, or the other way round, and a
# link that alternatives made what is owned where it leads to.
owner() {
  local name found
  for name in "$1" "/usr$1" "${1#/usr}" "$(readlink -f "$1")"; do
    if found=$(dpkg-query -S "$name" 2>/dev/null | grep -v '^diversion ' | head -n 1) && [ -n "$found" ]; then
      found=${found%%: *}   # PACKAGE:ARCHITECTURE, PACKAGE...
      found=${found%%,*}
      echo "${found%%:*}"
      return
    fi
  done
  echo "needed.sh: error: no package owns $1" >&2
  return 1
}

found=$(programs)
[ -n "$found" ] || { echo "needed.sh: error: $folder has no program" >&2; exit 1; }
loaded=$(while IFS= read -r file; do ldd "$file"; done <<<"$found")
if grep 'not found' <<<"$loaded" >&2; then
  echo "needed.sh: error: these libraries are not found" >&2
  exit 1
fi
# `NAME => FILE (ADDRESS)`, or `FILE (ADDRESS)`; what the kernel brings has no file.
libraries=$(sed -n 's/^\t\(.* => \)\{0,1\}\(\/.*\) (0x[0-9a-f]*)$/\2/p' <<<"$loaded" | sort -u)
packages=()
while IFS= read -r library; do
  case $library in "$folder"/*) continue ;; esac
  packages+=("$(owner "$library")")
done <<<"$libraries"
if grep -q '/libdcmdata\.so' <<<"$libraries"; then
  dictionary=$(find /usr/share -name dicom.dic | head -n 1)
  [ -n "$dictionary" ] || { echo "needed.sh: error: DCMTK has no dictionary, dicom.dic" >&2; exit 1; }
  packages+=("$(owner "$dictionary")")
fi
printf '%s\n' "${packages[@]}" | sort -u
