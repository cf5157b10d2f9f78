#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Installs what is missing (Debian 12 or 13; Ubuntu 24.04 has the same names in universe), builds Tetwarp, and deforms the
# built-in phantom: DICOM in; DICOM, NIfTI and pictures out. Safe to run again. CUDA is used where nvcc is found. Who can
# become root neither by itself nor by sudo is told what to install.
#
#   examples/quickstart.sh [OUTPUT_FOLDER]     default: ./first-light
#   examples/quickstart.sh --packages          names the packages, one a line
#
# Environment: TETWARP_CUDA_ARCHITECTURES (default: those of this machine's devices; without one, a few that serve all
# cards), TETWARP_JOBS (default: all cores), TETWARP_PRESET (default: cuda where nvcc is found, else cpu).
set -euo pipefail
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
out=${1:-first-light}
[[ $out != -* || $out = --packages ]] || out=./$out  # a name that begins with a dash is no option

packages=(
  g++ cmake ninja-build git ca-certificates xz-utils          # to build, and to unpack test data
  libtbb-dev libhwy-dev libeigen3-dev libglm-dev libgtest-dev libcli11-dev nlohmann-json3-dev
  libinsighttoolkit5-dev libdcmtk-dev libopenjp2-7-dev        # NIfTI, NRRD, MHA; DICOM, in JPEG 2000 too
  libfftw3-dev                                                # Debian 13's ITK asks for it when it is linked
  libdeflate-dev libminizip-dev libicu-dev libpng-dev zlib1g-dev libssl-dev libtomlplusplus-dev
  libturbojpeg0-dev libboost-dev                              # the viewer
  python3-dev python3-venv                                    # the Python package
  dicom3tools dcm2niix python3-pydicom python3-gdcm python3-numpy python3-nibabel  # independent readers that the tests ask
)
if [ "$out" = --packages ]; then
  printf '%s\n' "${packages[@]}"
  exit
fi
missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing+=("$package")
done
if [ ${#missing[@]} -gt 0 ]; then
  as_root=()
  [ "$(id -u)" = 0 ] || as_root=(sudo)
  if [ ${#as_root[@]} -gt 0 ] && ! command -v sudo >/dev/null; then
    printf 'quickstart.sh: error: packages are missing; have them installed as root:\n  apt-get install %s\n' "${missing[*]}" >&2
    exit 1
  fi
  echo "== installing: ${missing[*]}"
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
fi

preset=$("$source_dir/cmake/preset.sh")
configure=(--preset "$preset")
[ -z "${TETWARP_CUDA_ARCHITECTURES:-}" ] || configure+=("-DCMAKE_CUDA_ARCHITECTURES=$TETWARP_CUDA_ARCHITECTURES")
echo "== building (preset $preset)"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
(cd "$source_dir" && cmake "${configure[@]}" >"$log" 2>&1) || { cat "$log"; exit 1; }
sed -n 's/^-- Tetwarp: //p' "$log"  # what CMake chose by itself
(cd "$source_dir" && cmake --build --preset "$preset" --parallel "${TETWARP_JOBS:-$(nproc)}")
tetwarp="$source_dir/build/$preset/apps/tetwarp"

echo "== deforming the phantom"
mkdir -p "$out"
"$tetwarp" phantom -o "$out/phantom_dicom" --size 512,512,100 --spacing 0.8,0.8,3 --overwrite
"$tetwarp" deform "$out/phantom_dicom" -f wave:amplitude=8,wavelength=96 -f bubble:radius=90,strength=0.6 \
  -o "$out/deformed_dicom" --preview "$out/preview.png" --report "$out/report.json" --overwrite
"$tetwarp" deform "$out/phantom_dicom" -f wave:amplitude=8,wavelength=96 -f bubble:radius=90,strength=0.6 \
  -o "$out/deformed.nii.gz" --overwrite
"$tetwarp" render "$out/deformed_dicom" -o "$out/bones.png" --angle 25 --overwrite

cat <<END

The DICOM series:  $out/deformed_dicom
The NIfTI file:    $out/deformed.nii.gz
A picture of both: $out/preview.png
Bones, deformed:   $out/bones.png
What happened:     $out/report.json
The program:       $tetwarp
Take hold of it:   $tetwarp view --demo
END
