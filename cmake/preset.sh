#!/usr/bin/env bash
# Prints the preset for this machine: cuda where nvcc is found, else cpu. TETWARP_PRESET decides instead where it is set.
if [ -n "${TETWARP_PRESET:-}" ]; then
  echo "$TETWARP_PRESET"
elif command -v nvcc >/dev/null 2>&1; then
  echo cuda
else
  echo "no nvcc found: CPU only" >&2
  echo cpu
fi
