#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Runs the examples of ITK pipelines on real data. Builds what is not built.
#
#   examples/itk/run.sh [DATA_FOLDER [OUTPUT_FOLDER]]
#
# DATA_FOLDER    holds chest-cmb-crc/ (a DICOM series, found at any depth), lung-4dct-t0-t5/t0.mha and t5.mha (two phases
#                of a 4D-CT). Default: $TETWARP_TEST_DATA
# OUTPUT_FOLDER  default ./itk-examples
#
# Environment:
#   DICOM, FIXED, MOVING   other data: a folder of DICOM files; two volumes on one grid, MOVING is warped to FIXED, and
#                          breathes. DATA_FOLDER is not needed where all three are set
#   TETWARP_EXAMPLES       a folder of programs that are built already; nothing is built then
#   TETWARP_PRESET, TETWARP_CUDA_ARCHITECTURES, TETWARP_JOBS   for the build, as in examples/quickstart.sh
set -euo pipefail
source_dir=$(dirname "$(dirname "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")")")
scenario=$source_dir/examples/scenarios/diaphragm_push.json

refuse() {  # STATUS, TEXT
  echo "run.sh: error: $2" >&2
  exit "$1"
}

case ${1:-} in
  -h | --help) sed -n '5,/^set /{/^set /d;s/^# \{0,1\}//;p}' "${BASH_SOURCE[0]}"; exit 0 ;;
  -*) refuse 2 "unknown option $1; see --help" ;;
esac
[ $# -le 2 ] || refuse 2 "more than a data folder and an output folder; see --help"
data=${1:-${TETWARP_TEST_DATA:-}}
out=${2:-itk-examples}
[[ $out != -* ]] || out=./$out  # a name that begins with a dash is no option
dicom=${DICOM:-${data:+$data/chest-cmb-crc}}
fixed=${FIXED:-${data:+$data/lung-4dct-t0-t5/t5.mha}}
moving=${MOVING:-${data:+$data/lung-4dct-t0-t5/t0.mha}}
for input in "$dicom" "$fixed" "$moving"; do
  [ -n "$input" ] || refuse 2 "no data: name a folder, or set TETWARP_TEST_DATA; see --help"
  [ -e "$input" ] || refuse 4 "no such input: $input; see --help"
done

programs=${TETWARP_EXAMPLES:-}
if [ -z "$programs" ]; then
  preset=$("$source_dir/cmake/preset.sh" --built)
  programs=$source_dir/build/$preset/examples/itk
  if [ -f "$source_dir/build/$preset/CMakeCache.txt" ]; then
    echo "== building (preset $preset)"
    (cd "$source_dir" && cmake --build --preset "$preset" --parallel "${TETWARP_JOBS:-$(nproc)}" --target \
      tetwarp-example-dicom-pipeline tetwarp-example-register-and-warp tetwarp-example-sequence-4d)
  else
    "$source_dir/examples/quickstart.sh" "$source_dir/build/first-light"
  fi
fi

mkdir -p "$out"
echo "== a DICOM series, read by ITK and by Tetwarp, deformed, filtered, written"
time "$programs/tetwarp-example-dicom-pipeline" "$dicom" "$scenario" "$out/chest.nii.gz"
echo "== a registration by ITK, and its warp"
time "$programs/tetwarp-example-register-and-warp" "$fixed" "$moving" "$out/registered"
echo "== a CT that breathes"
time "$programs/tetwarp-example-sequence-4d" "$moving" "$scenario" "$out/breathing"

cat <<END

The deformed series:     $out/chest.nii.gz
The registered warp:     $out/registered/warped.mha, and by ITK: $out/registered/warped_by_itk.mha
The CT in motion:        $out/breathing/phase_01.mha and so on
END
