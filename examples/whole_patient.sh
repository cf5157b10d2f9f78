#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# A CT with all that belongs to it through one field: labels (made by thresholds), an RT Dose on a grid of its own, landmarks, and every map;
# then a picture of it (python3-nibabel, python3-matplotlib).
#
#   examples/whole_patient.sh CT_FOLDER DOSE.dcm [OUTPUT_FOLDER]     default: ./whole-patient
#
# Environment: TETWARP, the program (default: found in build/), SLICE, the one to draw (default: the middle).
set -euo pipefail
[ $# -ge 2 ] || { sed -n '5,11s/^# \{0,1\}//p' "$0" >&2; exit 2; }
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
ct=$1 dose=$2 out=${3:-whole-patient}
built=("$here"/../build/*/apps/tetwarp)
tetwarp=${TETWARP:-${built[0]}}
# Names from the root: they are used in OUTPUT_FOLDER, and a name that begins with a dash is no option.
[[ $ct == /* ]] || ct=$PWD/$ct
[[ $dose == /* ]] || dose=$PWD/$dose
[[ $out == /* ]] || out=$PWD/$out
[[ $tetwarp != */* || $tetwarp == /* ]] || tetwarp=$PWD/$tetwarp
[ -x "$tetwarp" ] || { echo "build Tetwarp first, or name the program in TETWARP" >&2; exit 1; }
mkdir -p "$out"

echo "== the volume as NIfTI, thresholds and landmarks from it"
"$tetwarp" deform "$ct" -f identity -o "$out/ct.nii.gz" --overwrite --quiet
/usr/bin/python3 "$here/whole_patient.py" labels "$out"

echo "== one field for all"
# IN=OUT:OPTIONS leaves no room for = and : in names, so the dose gets a plain one, and the others are named from within their folder.
plain=$(mktemp -d)
trap 'rm -rf "$plain"' EXIT
ln -s "$dose" "$plain/dose.dcm"
(cd "$out" && "$tetwarp" deform "$ct" -f bubble:radius=120,strength=0.5 -f twist:angle=8 -o deformed.nii.gz \
  --with labels.nii.gz=labels_deformed.nii.gz --with "$plain/dose.dcm=dose_deformed.nii.gz" \
  --points landmarks.csv=landmarks_deformed.csv \
  --coverage coverage.nii.gz --inverse inverse.nii.gz --jacobian jacobian.nii.gz --folds folds.nii.gz \
  --report report.json --overwrite)

/usr/bin/python3 "$here/whole_patient.py" picture "$out" ${SLICE:+"$SLICE"}
echo "A picture of it: $out/picture.png"
