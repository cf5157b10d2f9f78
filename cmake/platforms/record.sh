# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash

# What the scripts of this folder share; they read it with `source`, in the root of the sources.

# record_platform ROW SYSTEM COMPILER OPTIONS COMMIT TESTS BITS RESULT: keeps what a row of docs/reference/platforms.md came
# to, shows it, and writes the page anew.
record_platform() {
  local file=bench/results/platforms/$1.txt
  mkdir -p bench/results/platforms
  printf 'system: %s\ncompiler: %s\noptions: %s\ncommit: %s\ntests: %s\nbits: %s\nresult: %s\n' "${@:2}" >"$file"
  echo "date: $(date -u +%Y-%m-%d)" >>"$file"
  cat "$file"
  cmake/platforms/table.py --write
}

# record_bits ROW SYSTEM COMPILER OPTIONS COMMIT PROGRAM [ARGUMENT...]: keeps what the comparison of a program's bits alone came
# to; ARGUMENT: of tests/bits/check.py. Exit status 1: they differ.
record_bits() {
  local bits result=passed
  bits=$(tests/bits/check.py "${@:6}" | tail -1) || result=failed
  record_platform "${@:1:5}" "those of the bits alone" "$bits" $result
  [ $result = passed ]
}

# system_name: that of this machine. head_commit: the commit of the sources, with -dirty where they are not quite it (records left out). commit_of PROGRAM: the one that it was built of.
# compiler_of PROGRAM: the one that it says it was compiled with.
system_name() { echo "$(. /etc/os-release && echo "$PRETTY_NAME"), $(uname -m)"; }
head_commit() {
  local changed
  changed=$(git status --porcelain -- . ':!bench/results' ':!docs/reference/platforms.md' 2>/dev/null) || { echo unknown; return; }
  echo "$(git rev-parse --short=12 HEAD)${changed:+-dirty}"
}
compiler_of() { strings -a "$1" | awk '(/^GCC: / || /clang version/) && !found { print; found = 1 }'; }
commit_of() { "$1" --version | sed -n '1s/.*(\(.*\))$/\1/p'; }
