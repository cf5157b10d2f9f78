#!/usr/bin/env bash
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# A batch on a real Slurm: controller and daemon on loopback, the array job of examples/cluster, one task requeued in the middle of
# its work; then the bytes are those of a batch that nobody disturbed.
#
#   tests/examples/run_slurm.sh TETWARP
#
# Needs root, slurmctld, slurmd and munged (Debian: slurmctld slurmd munge). Status 77: something for it is missing.
set -euo pipefail
[ "${TETWARP_CI_FULL:-0}" = 1 ] || { echo "skipped: TETWARP_CI_FULL is not 1"; exit 77; }
[ "$(id -u)" = 0 ] || { echo "skipped: slurmd needs root"; exit 77; }
for program in slurmctld slurmd munged sbatch squeue; do
  command -v "$program" >/dev/null || { echo "skipped: no $program"; exit 77; }
done
export TETWARP
TETWARP=$(realpath "$1")
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
work=$(mktemp -d)
host=$(hostname -s)
finish() {
  status=$?
  for name in slurmctld slurmd munged; do [ ! -f "$work/$name.pid" ] || kill "$(cat "$work/$name.pid")" 2>/dev/null || true; done
  [ $status -eq 0 ] || tail -n 20 "$work"/*.log >&2
  sleep 1
  rm -rf "$work"
}
trap finish EXIT

echo "== munged, slurmctld, slurmd"
chmod 755 "$work"
mkdir -p "$work/munge" "$work/state" "$work/spool"
chmod 711 "$work/munge"
dd if=/dev/urandom of="$work/munge.key" bs=128 count=1 status=none
chmod 400 "$work/munge.key"
munged --force --key-file="$work/munge.key" --socket="$work/munge/socket" --pid-file="$work/munged.pid" \
  --log-file="$work/munged.log" --seed-file="$work/munge.seed"
cat > "$work/slurm.conf" <<CONF
ClusterName=loopback
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
CredType=cred/munge
SlurmctldPort=27817
SlurmdPort=27818
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=2
MpiDefault=none
ReturnToService=2
KillWait=10
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=2000 State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$work/slurm.conf
slurmctld -f "$SLURM_CONF"
slurmd -f "$SLURM_CONF" -N "$host"
for _ in $(seq 30); do
  [ "$(sinfo -h -o %T 2>/dev/null)" = idle ] && break
  sleep 1
done
sinfo

echo "== a batch of 24 cases, undisturbed"
cd "$work"
mkdir calm cluster
"$TETWARP" phantom -o ct.nrrd --size 160,160,96 --spacing 2.5,2.5,3 --quiet
echo "not a volume" > broken.nii.gz
cat > cohort.jsonl <<'LINES'
{"case": "v", "input": "ct.nrrd", "field": "elastic:amplitude=2..8,spacing=40..80", "seed": 4, "variants": 23, "inverse": "inverse.nii.gz"}
{"case": "broken", "input": "broken.nii.gz", "field": "identity"}
LINES
(cd calm && "$TETWARP" batch ../cohort.jsonl -o out --quiet) || [ $? -eq 3 ]

echo "== the same by Slurm, in three shards; task 2 is requeued while it works"
cd cluster
last=$("$source_dir/examples/cluster/submit.sh" ../cohort.jsonl out 3 --cpus-per-task=1 --mem=0)
array=$(squeue -h -o %F | sort -n | head -n 1)
for _ in $(seq 600); do
  [ -e out/batch.2-of-3.json ] && ls out | grep -q '^v-' && break
  sleep 0.1
done
squeue
scontrol requeue "${array}_2"
echo "requeued ${array}_2 with $(find out -maxdepth 1 -name 'v-*' | wc -l) cases done"
for _ in $(seq 300); do
  [ -z "$(squeue -h)" ] && break
  scontrol update "nodename=$host" state=resume 2>/dev/null || true
  sleep 1
done
[ -z "$(squeue -h)" ] || { squeue; echo "FAILED: jobs are left"; exit 1; }
cat tetwarp-merge-"$last".log
grep -h '"event":"batch"' tetwarp-*_2.log

echo "== compared"
cd ..
for folder in calm cluster; do
  (cd "$folder/out" && find . -type f -path './*/*' -exec sha256sum {} + | sort -k 2) > "$folder.sums"
done
cmp calm.sums cluster.sums
cmp calm/out/results.jsonl cluster/out/results.jsonl
[ "$(grep -c '"status":"done"' cluster/out/results.jsonl)" = 23 ]
[ "$(grep -c '"status":"refused"' cluster/out/results.jsonl)" = 1 ]
[ "$(wc -l < calm.sums)" -ge 80 ]
echo "$(wc -l < calm.sums) files with the same bytes, and the same results.jsonl"
slurmctld -V
