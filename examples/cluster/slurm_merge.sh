#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Joins what the tasks of a batch have recorded: the last job of a batch on Slurm. submit.sh submits it.
#
#   sbatch slurm_merge.sh MANIFEST OUTPUT_DIR
#
#SBATCH --job-name=tetwarp-merge
#SBATCH --output=tetwarp-merge-%j.log
set -euo pipefail
[ $# -eq 2 ] || { sed -n '5,8s/^# \{0,1\}//p' "$0" >&2; exit 2; }
manifest=$1 out=$2
[[ $manifest != -* ]] || manifest=./$manifest
[[ $out != -* ]] || out=./$out
exec "${TETWARP:-tetwarp}" batch "$manifest" -o "$out" --merge
