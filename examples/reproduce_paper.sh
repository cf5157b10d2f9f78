#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Makes the tables of the paper on this machine, with Tetwarp's numbers beside them. Builds what is not built.
#
#   examples/reproduce_paper.sh [OUTPUT_FOLDER [INPUT]] [-- BENCH OPTIONS...]
#
# OUTPUT_FOLDER  default ./paper-results. It receives
#                  paper.md     the tables
#                  paper.csv    the tables, for other programs
#                  paper.json   every number
#                  paper.svg    a drawing of them (where python3-matplotlib is installed)
#                  machine.txt  what it was measured on, and the options; no path, no name of host or user
#                Files of an earlier run are replaced once the new ones are complete.
# INPUT          a DICOM folder or .nii .nii.gz .nrrd .mha to measure with, instead of the built-in phantom
# BENCH OPTIONS  go to `tetwarp bench paper` as they are; `tetwarp bench paper --help` lists them
#
# Environment:
#   FRAMES=500        timed frames, as in the paper (default: that of the bench on a GPU, 3 on a CPU)
#   TETWARP_BACKEND   auto (default), cuda or cpu
#   TETWARP_PROGRAM   a tetwarp that is built already, tetwarp-bench beside it; nothing is built then
#   TETWARP_PRESET, TETWARP_CUDA_ARCHITECTURES, TETWARP_JOBS   for the build, as in examples/quickstart.sh
#
# Without a GPU it runs on the CPU, and by default with the smallest size of the paper alone, 512 x 512 x 141, 3 frames, 1 to
# warm up. Count on an hour or two with 2 cores; the last line below is a first look, with sizes that are not the paper's.
#
#   FRAMES=500 examples/reproduce_paper.sh results
#   examples/reproduce_paper.sh results study_folder -- --series 2 --fields wave,bubble
#   examples/reproduce_paper.sh first-look -- --width 64 --slices 40,60
set -euo pipefail
source_dir=$(dirname "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")")

refuse() {  # STATUS, TEXT
  echo "reproduce_paper.sh: error: $2" >&2
  exit "$1"
}

folders=() extra=()
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) sed -n '5,/^set /{/^set /d;s/^# \{0,1\}//;p}' "${BASH_SOURCE[0]}"; exit 0 ;;
    --) shift; extra=("$@"); break ;;
    -*) refuse 2 "unknown option $1; options of the bench follow --, see --help" ;;
    *) folders+=("$1"); shift ;;
  esac
done
[ ${#folders[@]} -le 2 ] || refuse 2 "more than an output folder and an input: ${folders[*]:2}; see --help"
out=${folders[0]:-paper-results}
input=${folders[1]:-}
[ -z "$input" ] || [ -e "$input" ] || refuse 4 "no such input: $input"

value_of() {  # OPTION: the value that BENCH OPTIONS give it, fails where they do not
  local n
  for ((n = 0; n < ${#extra[@]}; ++n)); do
    case ${extra[n]} in
      "$1") echo "${extra[n + 1]:-}"; return 0 ;;
      "$1="*) echo "${extra[n]#*=}"; return 0 ;;
    esac
  done
  return 1
}
given() { value_of "$1" >/dev/null; }
for option in --json --csv; do
  ! given "$option" || refuse 2 "$option is set by this script: the file goes to OUTPUT_FOLDER"
done

if [ -n "${TETWARP_PROGRAM:-}" ]; then
  tetwarp=$TETWARP_PROGRAM
else
  preset=$("$source_dir/cmake/preset.sh" --built)
  tetwarp=$source_dir/build/$preset/apps/tetwarp
  if [ -f "$source_dir/build/$preset/CMakeCache.txt" ]; then
    # A build that was made before is brought up to date, so that the numbers are those of the sources that lie here.
    echo "== building (preset $preset)"
    (cd "$source_dir" &&
      cmake --build --preset "$preset" --parallel "${TETWARP_JOBS:-$(nproc)}" --target tetwarp tetwarp-bench)
  else
    "$source_dir/examples/quickstart.sh" "$source_dir/build/first-light"
  fi
fi
publish=$source_dir/bench/publish/publish.py
command -v python3 >/dev/null || refuse 1 "no python3, which makes the tables; install it"
command -v "$tetwarp" >/dev/null || refuse 1 "no program $tetwarp; unset TETWARP_PROGRAM to build it"
version=$("$tetwarp" --version)

options=()
backend=$(value_of --backend || echo "${TETWARP_BACKEND:-auto}")
given --backend || options+=(--backend "$backend")
frames=${FRAMES:-}
if [ "$backend" = cpu ] || { [ "$backend" = auto ] && ! grep -q 'cuda: usable' <<<"$version"; }; then
  echo "== no GPU is used: this runs on the CPU, which takes long; one size and 3 frames unless told otherwise (see --help)"
  frames=${frames:-3}
  given --warmup || options+=(--warmup 1)
  [ -n "$input" ] || given --slices || given --raw || options+=(--slices 141)
fi
[ -z "$frames" ] || given --frames || options+=(--frames "$frames")

shown() {  # the options that were used, without what names a place, a file or a series
  local word before=
  [ -z "$input" ] || printf ' INPUT'
  for word in "${options[@]}" "${extra[@]}"; do
    case $word in
      --raw=* | --series=*.* | --*=*/*) printf ' %s=...' "${word%%=*}" ;;
      -*) printf ' %s' "$word" ;;
      *) if [[ $before == --raw || $before == --series && $word == *.* || $word == */* || -e $word ]]; then
           printf ' ...'
         else
           printf ' %s' "$word"
         fi ;;
    esac
    before=$word
  done
}

cached() {  # VARIABLE: what the build of the program was configured with; nothing where that is not known
  sed -n "s/^$1:[A-Z]*=//p" "$(dirname "$(readlink -f "$(command -v "$tetwarp")")")/../CMakeCache.txt" 2>/dev/null || true
}

describe_machine() {
  local compiler cuda="" gpu
  compiler=$(cached CMAKE_CXX_COMPILER)
  [ "$(cached TETWARP_WITH_CUDA)" != ON ] || cuda=$(cached CMAKE_CUDA_COMPILER)
  gpu=$(nvidia-smi --query-gpu=name,memory.total,driver_version --format=csv,noheader 2>/dev/null | uniq -c |
    sed 's/^ *\([0-9]*\) \(.*\), \(.*\), \(.*\)$/\1 x \2, \3, driver \4/') || gpu=
  echo "program        $(head -n 1 <<<"$version")"
  echo "options       $(shown)"
  echo "CPU            $(LC_ALL=C lscpu | sed -n 's/^Model name: *//p' | head -n 1), $(nproc) threads"
  echo "memory         $(awk '/^MemTotal/ { printf "%.0f GiB", $2 / 1048576 }' /proc/meminfo)"
  echo "GPU            ${gpu:-none found by nvidia-smi}"
  tail -n +2 <<<"$version" | sed 's/^ */backend        /'
  echo "kernel         $(uname -srm)"
  echo "distribution   $(sed -n 's/^PRETTY_NAME=//p' /etc/os-release | tr -d '"')"
  [ ! -x "$compiler" ] || echo "C++ compiler   $("$compiler" --version | head -n 1)"
  [ ! -x "$cuda" ] || echo "CUDA compiler  $("$cuda" --version | sed -n 's/^.*, \(release.*\)/\1/p')"
  [ ! -x "$cuda" ] || echo "CUDA targets   $(cached TETWARP_CUDA_COMPILED_FOR)"
}

mkdir -p "$out"
unfinished=$(mktemp -d "$out/.unfinished.XXXXXX")
trap 'rm -rf "$unfinished"' EXIT
describe_machine >"$unfinished/machine.txt"
echo "== tetwarp bench paper$(shown)"
"$tetwarp" bench paper ${input:+"$input"} --json "$unfinished/paper.json" "${options[@]}" "${extra[@]}" >/dev/null
"$publish" "$unfinished/paper.json" "$unfinished"/paper.{md,csv,json}
rm -f "$out/paper.svg"  # that of an earlier run shows other numbers
mv -f "$unfinished"/{machine.txt,paper.json,paper.csv,paper.md} "$out"

drawing="not made: no python3-matplotlib"
for python in python3 /usr/bin/python3; do
  if "$python" -c 'import matplotlib' 2>/dev/null; then
    "$python" "$publish" "$out/paper.json" "$unfinished/paper.svg"
    mv -f "$unfinished/paper.svg" "$out"
    drawing=$out/paper.svg
    break
  fi
done

cat <<END

The tables:   $out/paper.md and $out/paper.csv
Every number: $out/paper.json
A drawing:    $drawing
The machine:  $out/machine.txt
END
