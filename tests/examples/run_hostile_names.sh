#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# The scripts of examples/ with names that a shell would take for more than names: quotes, commands, line ends, dashes, blanks.
# Slurm is played by a small sbatch, which runs what is submitted at once as the real one does: a script with its arguments, or
# the text of --wrap by sh.
#
#   tests/examples/run_hostile_names.sh TETWARP
set -euo pipefail
tetwarp=$(realpath "$1")
examples=$(cd "$(dirname "${BASH_SOURCE[0]}")/../../examples" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
fail() { echo "FAILED: $*"; exit 1; }

mkdir bin
cat > bin/sbatch <<'SBATCH'
#!/usr/bin/env bash
tasks=1 wrap=
while [[ ${1:-} == -* ]]; do
  case $1 in
    --array=1-*) tasks=${1#--array=1-}; shift ;;
    --wrap) wrap=$2; shift 2 ;;
    *) shift ;;
  esac
done
for ((n = 1; n <= tasks; ++n)); do
  if [ -n "$wrap" ]; then sh -c "$wrap" >&2
  else SLURM_ARRAY_TASK_ID=$n SLURM_ARRAY_TASK_COUNT=$tasks bash "$@" >&2; fi || [ $? -eq 3 ] || exit
done
echo 1
SBATCH
chmod +x bin/sbatch
export PATH=$work/bin:$PATH
names=("it's; touch hurt; '" '$(touch hurt)`touch hurt`' '-o' '--wrap=x' $'two\nlines\n' ' blanks  ' '"quotes" & \back\' 'a=b:c,d' 'braces {out} {0}')

for name in "${names[@]}"; do
  [ ! -e here ] || rm -rf here
  mkdir here
  cd here
  "$tetwarp" phantom -o ct.nrrd --size 16,16,8 --spacing 20,20,25 --quiet
  cp "$tetwarp" "./program ${name//\//}"
  manifest=$name.jsonl out="$name out"
  printf '{"case": "a", "input": "ct.nrrd", "field": "translate:by=1/0/0", "variants": 3}\n' > "./$manifest"
  TETWARP="./program ${name//\//}" "$examples/cluster/submit.sh" "$manifest" "$out" 2 --partition=x >../log 2>&1 ||
    { cat ../log; fail "submit.sh with $name"; }
  [ "$(grep -c '"status":"done"' "./$out/results.jsonl")" = 3 ] || { cat ../log; fail "not 3 cases, $name"; }
  if command -v snakemake >/dev/null; then
    /usr/bin/python3 -c 'import json, sys; print(json.dumps(dict(zip(("manifest", "out", "tetwarp"), sys.argv[1:]))))' \
      "$manifest" "$out snake" "./program ${name//\//}" > ../config.json  # --config would read the names as YAML
    status=0
    HOME=$work XDG_CACHE_HOME=$work/cache snakemake -s "$examples/cluster/Snakefile" --cores 2 --configfile ../config.json \
      >../log 2>&1 || status=$?
    if [[ $name == *[{}]* ]]; then
      [ $status != 0 ] && grep -q 'Snakefile: error: braces in the name' ../log || { cat ../log; fail "braces, $name"; }
    else
      [ $status = 0 ] || { cat ../log; fail "Snakefile with $name"; }
      [ "$(grep -c '"status":"done"' "./$out snake/results.jsonl")" = 3 ] || { cat ../log; fail "not 3 cases by Snakemake, $name"; }
    fi
  fi
  cd ..
  [ -z "$(find . -name 'hurt*')" ] || fail "a name was run as a command: $name"
done
"$examples/cluster/submit.sh" m.jsonl out '1 --wrap=x' >log 2>&1 && fail "a number of tasks that is none"
grep -q 'submit.sh: error: N is' log || fail "no word on the number of tasks"
echo "${#names[@]} names went through submit.sh and Snakefile as names"
