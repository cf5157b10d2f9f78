#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Makes the virtual environment in which the tests of the Python package run, and builds the package's module in the
# build of a preset, with the program of the same commit, which the tests compare with.
#
#   tests/python_environment.sh PRESET [--peers]
#
# --peers also installs the large libraries whose arrays and images are taken (itk, PyTorch, TorchIO, MONAI, JAX), those of
# Zarr and HDF5, and what executes the notebooks.
# Where there is no Python of 3.10 or later with headers and venv, or no package index, one line says so and the tests are left out.
set -euo pipefail
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$source_dir/build/$1 environment=$source_dir/build/python-venv
packages=(nanobind numpy pytest nibabel SimpleITK pydicom mypy playwright axe-playwright-python)
[ "${2:-}" != --peers ] || packages+=(itk torch torchio monai jax zarr h5py ngff-zarr jupytext nbclient ipykernel matplotlib)
skip() { echo "== no tests of the Python package: $1" >&2; exit 0; }
python3 -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null || skip "python3 is missing or older than 3.10"
python3 -c 'import os, sysconfig, sys; sys.exit(not os.path.exists(sysconfig.get_path("include") + "/Python.h"))' ||
  skip "python3 has no headers; install python3-dev"
if [ ! -x "$environment/bin/python" ]; then
  python3 -m venv "$environment" >/dev/null || { rm -rf "$environment"; skip "python3 has no venv; install python3-venv"; }
fi
if [ "$(cat "$environment/installed" 2>/dev/null)" != "${packages[*]}" ]; then
  "$environment/bin/pip" install -q "${packages[@]}" || skip "pip could not install ${packages[*]}"
  echo "${packages[*]}" >"$environment/installed"
fi
log=$(mktemp)
trap 'rm -f "$log"' EXIT
(cd "$source_dir" && cmake -B "$build" -DTETWARP_BUILD_PYTHON=ON -DPython_EXECUTABLE="$environment/bin/python" >"$log" 2>&1 &&
  cmake --build "$build" --target tetwarp_package tetwarp --parallel "${TETWARP_JOBS:-$(nproc)}" >>"$log" 2>&1) || { cat "$log"; exit 1; }
