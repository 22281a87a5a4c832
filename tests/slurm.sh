#!/usr/bin/env bash
# Shards on a real Slurm: brings up Debian's (slurm-wlm, munge) on loopback as root, without systemd, with two virtual
# nodes on this one machine; submits a picture by `gloss submit`, sets one node down in the middle, lets Slurm start the
# lost task again, waits for the dependent merge, and compares the bits with those of a single run. Then a task with a
# time limit is told to end, goes back into the queue and on from its checkpoint. Cleans up after itself.
#
#   tests/slurm.sh [GLOSS]     GLOSS is the program to test; target/release/gloss or target/debug/gloss if left out
#   QUICK=1 tests/slurm.sh     without the second part
set -euo pipefail
cd "$(dirname "$0")/.."

gloss=${1:-target/release/gloss}
[ -x "$gloss" ] || gloss=target/debug/gloss
gloss=$(realpath "$gloss")

if [ "$(id -u)" -ne 0 ]; then
  echo "skipped: it takes root to start Slurm"
  exit 0
fi
if pgrep -x slurmctld >/dev/null || pgrep -x munged >/dev/null; then
  echo "skipped: a Slurm or munge of this machine's own is running"
  exit 0
fi
if ! command -v sbatch >/dev/null || ! command -v munged >/dev/null; then
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive apt-get install -y -qq slurm-wlm munge >/dev/null
fi

work=$(mktemp -d)
host=$(hostname -s)
export SLURM_CONF=$work/slurm.conf

# --- down again, whatever happens ---
down() {
  code=$?
  set +e
  [ "$code" -eq 0 ] || { echo "--- failed; the end of the logs:"; tail -n 20 "$work"/*.log "$work"/*/*.log 2>/dev/null; }
  scancel --user root 2>/dev/null
  sleep 1
  local pids=()
  for daemon in slurmctld slurmd-n1 slurmd-n2 munged; do
    [ -f "$work/$daemon.pid" ] && pids+=("$(cat "$work/$daemon.pid")")
  done
  [ ${#pids[@]} -eq 0 ] || kill "${pids[@]}"
  for _ in $(seq 100); do
    kill -0 "${pids[@]}" 2>/dev/null || break
    sleep 0.1
  done
  rm -rf "$work"
  exit "$code"
}
trap down EXIT

# --- up ---
chmod 0755 "$work"
install -d -o munge -g munge -m 0755 "$work/munge"
head -c 64 /dev/urandom >"$work/munge/key"
chown munge:munge "$work/munge/key"
chmod 0600 "$work/munge/key"
su -s /bin/sh munge -c "/usr/sbin/munged --key-file=$work/munge/key --socket=$work/munge/socket \
  --pid-file=$work/munge/pid --log-file=$work/munge/log --seed-file=$work/munge/seed"
ln -s "$work/munge/pid" "$work/munged.pid"

echo "CgroupAutomount=no" >"$work/cgroup.conf"
cat >"$SLURM_CONF" <<CONF
ClusterName=local
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
# A task that is started again waits until its old credential has expired: two minutes by default.
AuthInfo=socket=$work/munge/socket,cred_expire=10
CredType=cred/munge
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
JobCompType=jobcomp/none
StateSaveLocation=$work/ctld
SlurmctldPidFile=$work/slurmctld.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmctldPort=6817
SlurmdSpoolDir=$work/d-%n
SlurmdPidFile=$work/slurmd-%n.pid
SlurmdLogFile=$work/slurmd-%n.log
ReturnToService=2
MaxArraySize=10001
SchedulerParameters=batch_sched_delay=0,sched_interval=1,bf_interval=1,sched_min_interval=0
MinJobAge=300
SlurmdTimeout=10
KillWait=5
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=17001 CPUs=1 RealMemory=1000
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=17002 CPUs=1 RealMemory=1000
PartitionName=render Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
mkdir -p "$work/ctld" "$work/d-n1" "$work/d-n2"
slurmctld
slurmd -N n1
slurmd -N n2
for _ in $(seq 60); do
  [ "$(sinfo --noheader --states=idle --format=%D 2>/dev/null)" = 2 ] && break
  sleep 0.5
done
sinfo

# --- a picture ---
cat >"$work/scene.toml" <<'SCENE'
settings = { spp = 8000, max_depth = 3, adaptive = false }
camera = { resolution = [64, 48], eye = [0, 1, 5], look_at = [0, 0, 0] }
environment = { type = "gradient", nadir = [0.1, 0.2, 0.1], horizon = [0.5, 0.6, 0.9], zenith = [2, 1.5, 1] }
[materials.shiny]
type = "cosine-power"
exponent = 20
[[shapes]]
type = "sphere"
material = "shiny"
spheres = [[0, 0, 0, 1], [-1.8, 0, 0, 0.7], [1.8, 0.3, 0, 0.8]]
SCENE
cd "$work"
state() { scontrol show job "$1" 2>/dev/null | grep -o 'JobState=[A-Z_]*' | sort | uniq -c | tr '\n' ' '; }
# Whether two checkpoints hold the same sums: each file has their BLAKE3 sum in its header.
same_bits() {
  local a b
  a=$(tr -cd '[:print:]' <"$1" | grep -oE 'gloss\.pixels_sumstring@[0-9a-f]{64}')
  b=$(tr -cd '[:print:]' <"$2" | grep -oE 'gloss\.pixels_sumstring@[0-9a-f]{64}')
  echo "$1: ${a##*@}"
  echo "$2: ${b##*@}"
  [ -n "$a" ] && [ "$a" = "$b" ]
}
# Until every task of a job is in a state that matches.
await() {
  for _ in $(seq "$3"); do
    local open
    open=$(scontrol show job "$1" 2>/dev/null | grep -o 'JobState=[A-Z_]*' | grep -vcE "$2" || true)
    [ "$open" -eq 0 ] && return 0
    sleep 0.5
  done
  echo "job $1 is not done: $(state "$1")"
  scontrol show job "$1"
  return 1
}

"$gloss" render scene.toml -o whole.exr --checkpoint whole.sums.exr --quiet

# --- part one: a node goes down in the middle ---
started=$SECONDS
mapfile -t ids < <("$gloss" submit scene.toml -o merged.exr --engine slurm --tasks 6 --time 10m -- --checkpoint-every 500ms)
echo "array ${ids[0]}, merge ${ids[1]}"
for _ in $(seq 100); do
  [ -n "$(squeue --noheader --states=running --nodelist=n2 --format=%i)" ] && break
  sleep 0.1
done
sleep 0.5
echo "n2 goes down with: $(squeue --noheader --states=running --nodelist=n2 --format=%i)"
scontrol update nodename=n2 state=down reason=test
squeue --format='%i %T %N %r'
sleep 2
scontrol update nodename=n2 state=resume 2>/dev/null || true # it may have come back by itself
await "${ids[0]}" 'COMPLETED' 240
await "${ids[1]}" 'COMPLETED' 60
echo "array: $(state "${ids[0]}") merge: $(state "${ids[1]}") in $((SECONDS - started)) s"
scontrol show job "${ids[0]}" | grep -oE 'ArrayTaskId=[0-9]+|Restarts=[0-9]+|NodeList=n[0-9]' | paste -sd' ' | sed 's/ArrayTaskId/\n  ArrayTaskId/g'
restarts=$(scontrol show job "${ids[0]}" | grep -oE 'Restarts=[1-9]' | wc -l)
[ "$restarts" -ge 1 ] || { echo "no task was started again: the test has tested nothing"; exit 1; }
"$gloss" merge --quiet --checkpoint merged.sums.exr merged.exr.shards/shard-*.exr
same_bits whole.sums.exr merged.sums.exr
"$gloss" diff whole.exr merged.exr --threshold 0

# --- part two: told to end before the limit, back into the queue, gone on with ---
if [ -z "${QUICK:-}" ]; then
  started=$SECONDS
  mapfile -t ids < <("$gloss" submit scene.toml -o limited.exr --engine slurm --tasks 1 --time 10m --directory limited \
    -- --checkpoint-every 500ms)
  for _ in $(seq 200); do
    [ -f limited/shard-0.exr.part ] && break
    sleep 0.1
  done
  # The signal that Slurm would send a minute before the limit, to the same script.
  scancel --batch --signal=TERM "${ids[0]}_0"
  for _ in $(seq 100); do
    [ -n "$(squeue --noheader --states=pending --format=%i --job "${ids[0]}")" ] && break
    sleep 0.2
  done
  squeue --format='%i %T %N %r'
    await "${ids[0]}" 'COMPLETED' 240
  await "${ids[1]}" 'COMPLETED' 60
  echo "array: $(state "${ids[0]}") merge: $(state "${ids[1]}") in $((SECONDS - started)) s"
  scontrol show job "${ids[0]}" | grep -oE 'Restarts=[0-9]+'
  grep "has all of it" limited/*.log
  same_bits whole.sums.exr limited/shard-0.exr
fi
echo "Slurm: all is well"
