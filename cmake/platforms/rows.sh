#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Builds Tetwarp in one of several ways, runs its tests and compares its bits (tests/bits), and keeps a record, of which
# docs/reference/platforms.md is made.
#
#   cmake/platforms/rows.sh ROW...
#
# ROW: gcc12, clang14, clang19, lto (with shared libraries), lto-program (static, the bits alone), shared (libraries), minimal (no
# ITK, DCMTK, VTK, CUDA, viewer) or assertions (those of libstdc++), on Debian 12; debian13, as root, in a bare system
# (inside.sh). clang14 and clang19 want the packages clang-14 and clang-19. A warning is an error in every row. All are without
# CUDA. TETWARP_JOBS: default all cores.
set -euo pipefail
[ $# -ge 1 ] || { sed -n '5,14p' "$0" | sed 's/^# \{0,1\}//'; exit 2; }
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source cmake/platforms/record.sh
source_dir=$PWD
jobs=${TETWARP_JOBS:-$(nproc)}
warnings="-Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion -Werror"

# build_row ROW COMPILER TARGET OPTIONS: builds in build/rows/ROW.
build_row() {
  local row=$1 compiler=$2 target=$3 options=("${@:4}") build=build/rows/$1 flags=$warnings links=() kind
  case $compiler in
    g++*) flags="$flags -Wno-restrict" ;;  # GCC 12 warns of std::string's own code
    # Clang 19 warns of what GCC 12's std::stable_sort calls, and Debian 12's ITK is for GCC alone unless it is told otherwise.
    clang*) flags="$flags -Wno-deprecated-declarations -include $source_dir/tests/fuzz/itk_with_clang.h $(itk_headers)" ;;
  esac
  if [[ $row = lto* ]]; then
    # GCC 12 compiles again when it links. Then it warns of its own avx512fintrin.h, which leaves numbers undefined on purpose and
    # of which it does not while it compiles, and of std::string, of which the build asks it not to.
    local quiet="-Wno-uninitialized -Wno-maybe-uninitialized -Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread"
    for kind in EXE SHARED MODULE; do links+=("-DCMAKE_${kind}_LINKER_FLAGS=$quiet"); done
  fi
  rm -f "bench/results/platforms/$row.txt"  # a row that fails to build has no record
  echo "== $row: $("$compiler" --version | head -1)"
  cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DTETWARP_WITH_CUDA=OFF -DCMAKE_CXX_COMPILER="$compiler" \
    "-DCMAKE_CXX_FLAGS=$flags" "${links[@]}" "${options[@]}" >"$build.log" 2>&1 || { tail -20 "$build.log"; return 1; }
  cmake --build "$build" --target "$target" --parallel "$jobs" -- -k 0 >>"$build.log" 2>&1 ||
    { grep -A12 "^FAILED" "$build.log" | tail -60; return 1; }
}

# record ROW COMPILER OPTIONS: builds, tests, and writes what came out.
record() {
  local row=$1 compiler=$2 options=("${@:3}") build=build/rows/$1 tests bits result=passed
  build_row "$row" "$compiler" all "${options[@]}" || return 1
  ctest --test-dir "$build" -j "$jobs" --output-on-failure --no-tests=error >>"$build.log" 2>&1 || result=failed
  tests=$(grep -o '[0-9]*% tests passed, [0-9]* tests failed out of [0-9]*' "$build.log" | tail -1 || true)
  bits=$(tests/bits/check.py "$build/apps/tetwarp" | tail -1) || result=failed
  record_platform "$row" "$(system_name)" "$("$compiler" --version | head -1)" "${options[*]:-none}" "$(head_commit)" "${tests:-none}" "$bits" $result
  [ $result = passed ]
}

# record_program ROW COMPILER OPTIONS: the same of the program alone, and its bits.
record_program() {
  build_row "$1" "$2" tetwarp "${@:3}" || return 1
  record_bits "$1" "$(system_name)" "$("$2" --version | head -1)" "${*:3}" "$(head_commit)" "build/rows/$1/apps/tetwarp"
}

# The option that makes the folder of ITK's headers known to all sources: clang reads what `-include` names once, when it makes a
# precompiled header, which knows of no ITK by itself.
itk_headers() {
  local folder
  for folder in /usr/include/ITK-*; do [ ! -d "$folder" ] || echo "-isystem $folder"; done
}

# The row of Debian 13 is this script's row of the system's own compiler, in a bare system.
debian13() {
  local made status=0
  made=$(mktemp -d)
  cmake/platforms/inside.sh trixie "$made" \
    sh -c 'cmake/platforms/rows.sh system; status=$?; cp bench/results/platforms/system.txt /output; exit $status' || status=$?
  mkdir -p bench/results/platforms
  cp "$made/system.txt" bench/results/platforms/debian13.txt && cmake/platforms/table.py --write || status=1
  rm -r "$made"
  return $status
}

mkdir -p build/rows
status=0
for row in "$@"; do
  case $row in
    gcc12) record $row g++-12 ;;
    clang14) record $row clang++-14 ;;
    clang19) record $row clang++-19 ;;
    # With static libraries each of 160 programs would compile the whole library anew, for hours.
    lto) record $row g++-12 -DCMAKE_INTERPROCEDURAL_OPTIMIZATION=ON -DBUILD_SHARED_LIBS=ON ;;
    lto-program) record_program $row g++-12 -DCMAKE_INTERPROCEDURAL_OPTIMIZATION=ON ;;
    minimal) record $row g++-12 -DTETWARP_WITH_ITK=OFF -DTETWARP_WITH_DCMTK=OFF -DTETWARP_WITH_VTK=OFF -DTETWARP_WITH_VIEW=OFF ;;
    shared) record $row g++-12 -DBUILD_SHARED_LIBS=ON ;;
    assertions) record $row g++-12 -DCMAKE_CXX_FLAGS_RELEASE="-O2 -DNDEBUG -D_GLIBCXX_ASSERTIONS" ;;
    system) record $row g++ ;;
    debian13) debian13 ;;
    *) echo "rows.sh: error: no row $row" >&2; exit 2 ;;
  esac || status=1
done
exit $status
