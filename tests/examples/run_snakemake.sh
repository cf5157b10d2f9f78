#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# The Snakemake workflow of examples/cluster: a small batch, one of its cases broken, then once more with nothing to do.
#
#   tests/examples/run_snakemake.sh TETWARP
#
# Status 77: snakemake is missing.
set -euo pipefail
command -v snakemake >/dev/null || { echo "skipped: no snakemake"; exit 77; }
tetwarp=$(realpath "$1")
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
export HOME=$work XDG_CACHE_HOME=$work/cache
"$tetwarp" phantom -o ct.nrrd --size 40,40,16 --spacing 9,9,12 --quiet
echo "not a volume" > broken.nii.gz
cat > cohort.jsonl <<'LINES'
{"case": "v", "input": "ct.nrrd", "field": "elastic:amplitude=2..8,spacing=40..80", "seed": 4, "variants": 3}
{"case": "broken", "input": "broken.nii.gz", "field": "identity"}
LINES
flow=(snakemake -s "$source_dir/examples/cluster/Snakefile" --cores 2 --config manifest=cohort.jsonl out=out "tetwarp=$tetwarp")
"${flow[@]}" >log 2>&1 || { cat log; exit 1; }
[ "$(grep -c '"status":"done"' out/results.jsonl)" = 3 ] || { echo "FAILED: not 3 cases done"; cat out/results.jsonl; exit 1; }
[ "$(grep -c '"status":"refused"' out/results.jsonl)" = 1 ] || { echo "FAILED: the broken case has no result"; exit 1; }
"$tetwarp" batch cohort.jsonl -o alone --quiet || [ $? -eq 3 ]
cmp out/v-2/deformed.nii.gz alone/v-2/deformed.nii.gz
"${flow[@]}" >log 2>&1
grep -q "Nothing to be done" log || { echo "FAILED: something was done again"; cat log; exit 1; }
echo "4 cases, each a rule; the second run had nothing to do"
