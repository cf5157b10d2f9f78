#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Submits a batch to Slurm as an array job of N tasks, and a job after them that joins their results.
#
#   examples/cluster/submit.sh MANIFEST OUTPUT_DIR N [SBATCH OPTIONS]
#
# Environment: TETWARP, the program as the nodes find it (default: tetwarp in PATH). Prints the number of the last job.
set -euo pipefail
[ $# -ge 3 ] || { sed -n '5,9s/^# \{0,1\}//p' "$0" >&2; exit 2; }
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
manifest=$1 out=$2 tasks=$3
shift 3
[[ $tasks =~ ^[1-9][0-9]*$ ]] || { echo "submit.sh: error: N is \"$tasks\"; expected a number of tasks" >&2; exit 2; }
[[ $manifest != -* ]] || manifest=./$manifest  # a name that begins with a dash is no option
[[ $out != -* ]] || out=./$out
"${TETWARP:-tetwarp}" batch "$manifest" -o "$out" --dry-run >/dev/null  # checks the manifest before anything is submitted
array=$(sbatch --parsable --array="1-$tasks" "$@" "$here/slurm_array.sh" "$manifest" "$out")
# afterany: a task with failed cases ends with status 3, and its results are joined, too. Names are passed as arguments,
# never within the text of a shell.
sbatch --parsable --dependency="afterany:$array" "$here/slurm_merge.sh" "$manifest" "$out"
