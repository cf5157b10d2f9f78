#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Compares what two programs make of the same fields, byte for byte: volumes with each interpolation, all maps,
# simulations and pictures. For builds that must agree (with and without vectors), and for a change that must keep bits.
#
#   tests/same_bits.sh PROGRAM OTHER_PROGRAM [OPTION...]
#
# OPTION: further options of every `deform` and `simulate`, such as --threads 1.
set -euo pipefail
[ $# -ge 2 ] || { sed -n '4,9p' "$0" | sed 's/^# \{0,1\}//'; exit 2; }
programs=("$(realpath "$1")" "$(realpath "$2")")
shift 2
scenarios=$(cd "$(dirname "${BASH_SOURCE[0]}")/../examples/scenarios" && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cd "$scratch"
compared=0
differ=0

# both NAME COMMAND...: runs a command of each program in a folder of its own, and compares all that lies there.
both() {
  local name=$1
  shift
  rm -rf made
  for n in 0 1; do
    mkdir -p "made/$n"
    (cd "made/$n" && "${programs[n]}" "$@" --quiet 2>warnings) || { echo "$name: ${programs[n]} failed"; cat "made/$n/warnings"; exit 1; }
    rm -f "made/$n/warnings" "made/$n/"*.json  # sidecars name the program's commit
  done
  local file
  for file in made/0/*; do
    compared=$((compared + 1))
    cmp -s "$file" "made/1/${file##*/}" || { differ=$((differ + 1)); echo "$name: ${file##*/} differs"; }
  done
}

size=(--size 90,70,50 --spacing 3,3,5)
both phantom phantom -o ct.mha "${size[@]}"
cp made/0/ct.mha .
"${programs[0]}" phantom -o turned.nii.gz "${size[@]}" --seed 2 --quiet
maps=(--coverage coverage.mha --inverse inverse.mha --jacobian jacobian.mha --folds folds.mha --outside background)
for field in identity translate:by=1.5/-2/3 wave:amplitude=12,wavelength=60 wave:amplitude=5,wavelength=40,along=x,axis=y \
  twist:angle=50 bubble:radius=90,strength=0.8 bubble:radius=60,strength=5 bubble-paper:shift=-9 \
  elastic:amplitude=9,spacing=40,seed=3 elastic:amplitude=30,spacing=30,seed=4; do
  for cell in 1 2 3 5 8 17; do
    both "$field, cells of $cell" deform "$scratch/ct.mha" -f "$field" --cell-size $cell --outside background -o out.mha "$@"
    both "$field, cells of $cell, maps" deform "$scratch/ct.mha" -f "$field" --cell-size $cell -o out.mha "${maps[@]}" "$@"
  done
  for interpolation in nearest cubic vote; do
    both "$field, $interpolation" deform "$scratch/turned.nii.gz" -f "$field" --cell-size 4 --interpolation $interpolation \
      --outside rest -o out.nii "$@"
  done
done
for scenario in "$scenarios"/*.json; do
  name=$(basename "$scenario" .json)
  sed 's/"cell_size": *[0-9.]*/"cell_size": 4/' "$scenario" >"$name.json"
  both "$name" simulate "$scratch/$name.json" "$scratch/ct.mha" -o field.mha "$@"
  both "$name, deformed" deform "$scratch/ct.mha" --scenario "$scratch/$name.json" -o out.mha "${maps[@]}" "$@"
done
both picture render "$scratch/ct.mha" -o picture.png --angle 30
echo "$compared files compared, $differ differ"
[ "$differ" = 0 ]
