#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Redraws the paper's figures 7 and 8: a lung, a colon and an upper leg, undeformed and through Wave, Twist and Bubble.
#
#   examples/figures.sh [OUTPUT_FOLDER [DATA_FOLDER]]      default: ./figures
#
# OUTPUT_FOLDER receives a picture for each, and figures.html, which shows them as a table. Pictures of an earlier run are replaced.
# DATA_FOLDER has real series, unpacked, with the names of the project's test data (default: $TETWARP_TEST_DATA). What is not there is
# left out; the phantom is drawn in any case.
#
# Environment: TETWARP, the program (default: found in build/), SIZE, pixels of a picture (default 512,512), PHANTOM, how the phantom is
# made (default "--size 512,512,300 --spacing 0.8,0.8,1"), BACKEND (auto, cuda or cpu).
set -euo pipefail
case ${1:-} in -h | --help) sed -n '5,/^set /{/^set /d;s/^# \{0,1\}//;p}' "$0"; exit 0 ;; esac
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
out=${1:-figures} data=${2:-${TETWARP_TEST_DATA:-}}
[[ $out != -* ]] || out=./$out  # a name that begins with a dash is no option
[[ $data != -* ]] || data=./$data
built=("$here"/../build/*/apps/tetwarp)
tetwarp=${TETWARP:-${built[0]}}
[ -x "$tetwarp" ] || { echo "figures.sh: build Tetwarp first, or name the program in TETWARP" >&2; exit 1; }
mkdir -p "$out"

fields=(undeformed wave twist bubble)
formula() {  # FIELD: the options of render
  case $1 in
    undeformed) ;;
    wave) echo "-f wave:amplitude=12,wavelength=110 --cell-size 4" ;;
    twist) echo "-f twist:angle=35 --cell-size 4" ;;
    bubble) echo "-f bubble:radius=140,strength=0.7 --cell-size 4" ;;
  esac
}

rows=()
row() {  # NAME, VOLUME, OPTIONS...: a picture for each field
  local name=$1 volume=$2 field
  shift 2
  if [ ! -e "$volume" ]; then
    echo "left out: $name, no $volume"
    return
  fi
  rows+=("$name")
  for field in "${fields[@]}"; do
    # shellcheck disable=SC2046
    "$tetwarp" render "$volume" -o "$out/$name-$field.png" "$@" $(formula "$field") --size "${SIZE:-512,512}" --backend "${BACKEND:-auto}" \
      --overwrite --quiet
    echo "$out/$name-$field.png"
  done
}

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
read -ra phantom <<<"${PHANTOM:---size 512,512,300 --spacing 0.8,0.8,1}"
"$tetwarp" phantom -o "$work/phantom.nii" "${phantom[@]}" --quiet
row phantom-bone "$work/phantom.nii" --transfer ct-bone --angle 25 --elevation 10
row phantom-skin "$work/phantom.nii" --transfer ct-skin --angle 25 --elevation 10
row phantom-lung "$work/phantom.nii" --transfer ct-lung
row lung "${data:-no-data}/chest-cmb-crc" --transfer ct-lung
row chest "${data:-no-data}/chest-cmb-crc" --transfer ct-bone --angle 20
row colon "${data:-no-data}/abdomen-acrin-flt" --transfer "$here/transfer/colon.json"
row upper-leg "${data:-no-data}/abdomen-acrin-flt" --transfer ct-bone --angle 20 --zoom 2.4 --position 95/0/-775

{
  echo '<!doctype html><meta charset="utf-8"><title>Figures 7 and 8</title><table>'
  printf '<tr><th>'
  printf '<th>%s' "${fields[@]}"
  echo
  for name in "${rows[@]}"; do
    printf '<tr><th>%s' "$name"
    for field in "${fields[@]}"; do printf '<td><img src="%s-%s.png">' "$name" "$field"; done
    echo
  done
  echo '</table>'
} >"$out/figures.html"
echo "All of them: $out/figures.html"
