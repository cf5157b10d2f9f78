#!/usr/bin/env bash
# A CT with all that belongs to it through one field: labels (made by thresholds), an RT Dose on a grid of its own, landmarks, and every map;
# then a picture of it (python3-nibabel, python3-matplotlib).
#
#   examples/whole_patient.sh CT_FOLDER DOSE.dcm [OUTPUT_FOLDER]     default: ./whole-patient
#
# Environment: TETWARP, the program (default: found in build/), SLICE, the one to draw (default: the middle).
set -euo pipefail
[ $# -ge 2 ] || { sed -n '2,8s/^# \{0,1\}//p' "$0" >&2; exit 2; }
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
ct=$1 dose=$2 out=${3:-whole-patient}
tetwarp=${TETWARP:-$(ls "$here"/../build/*/apps/tetwarp 2>/dev/null | head -n 1)}
[ -x "$tetwarp" ] || { echo "build Tetwarp first, or name the program in TETWARP" >&2; exit 1; }
mkdir -p "$out"

echo "== the volume as NIfTI, thresholds and landmarks from it"
"$tetwarp" deform "$ct" -f identity -o "$out/ct.nii.gz" --overwrite --quiet
/usr/bin/python3 "$here/whole_patient.py" labels "$out"

echo "== one field for all"
"$tetwarp" deform "$ct" -f bubble:radius=120,strength=0.5 -f twist:angle=8 -o "$out/deformed.nii.gz" \
  --with "$out/labels.nii.gz=$out/labels_deformed.nii.gz" --with "$dose=$out/dose_deformed.nii.gz" \
  --points "$out/landmarks.csv=$out/landmarks_deformed.csv" \
  --coverage "$out/coverage.nii.gz" --inverse "$out/inverse.nii.gz" --jacobian "$out/jacobian.nii.gz" --folds "$out/folds.nii.gz" \
  --report "$out/report.json" --overwrite

/usr/bin/python3 "$here/whole_patient.py" picture "$out" ${SLICE:+"$SLICE"}
echo "A picture of it: $out/picture.png"
