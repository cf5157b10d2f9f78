#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# One share of a batch: a task of a Slurm array job. submit.sh submits it; edit what a task gets.
#
#   sbatch --array=1-8 slurm_array.sh MANIFEST OUTPUT_DIR
#
#SBATCH --job-name=tetwarp
#SBATCH --cpus-per-task=4
#SBATCH --mem=8G
#SBATCH --time=04:00:00
#SBATCH --requeue
#SBATCH --signal=B:TERM@60
#SBATCH --output=tetwarp-%A_%a.log
#
# For a GPU each add: #SBATCH --gres=gpu:1
#
# A task that is preempted, killed or out of time goes on where it was when it is queued again: --resume keeps finished cases after a
# look at their hashes. TERM comes a minute before the time is up; the batch then ends within seconds and leaves nothing half made.
set -euo pipefail
[ $# -eq 2 ] || { sed -n '5,8s/^# \{0,1\}//p' "$0" >&2; exit 2; }
manifest=$1 out=$2
[[ $manifest != -* ]] || manifest=./$manifest  # a name that begins with a dash is no option
[[ $out != -* ]] || out=./$out
memory=()
[ -z "${SLURM_MEM_PER_NODE:-}" ] || memory=(--memory "$((SLURM_MEM_PER_NODE * 9 / 10))M")
exec "${TETWARP:-tetwarp}" batch "$manifest" -o "$out" --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" --resume \
  --threads "${SLURM_CPUS_PER_TASK:-0}" "${memory[@]}" --log-json
