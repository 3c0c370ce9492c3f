#!/usr/bin/env bash
# A campaign on a real Slurm: munge, a controller and three nodes on this machine's loopback, without systemd. Shows a plain
# run, a task that fails once, and a node killed in the middle of its tasks; the published tables must be those of one
# process, byte for byte. Needs root where Slurm is to be installed (Debian's slurm-wlm). Skipped where it is neither
# there nor can be installed; with CI=true that is a failure.
#
#   tests/cluster/slurm.sh HARVEST     the program, built
set -euo pipefail
cd "$(dirname "$0")/../.."

harvest=$(realpath "${1:?the program: target/release/harvest}")
skip() {
    echo "skipped: $1"
    [ "${CI:-}" != true ] || exit 1
    exit 0
}

if ! command -v slurmctld >/dev/null; then
    if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null; then
        skip "no slurmctld here, and it cannot be installed"
    fi
    export DEBIAN_FRONTEND=noninteractive
    { timeout 120 apt-get update && timeout 180 apt-get install -y --no-install-recommends slurm-wlm munge; } >/dev/null 2>&1 || {
        skip "slurm-wlm could not be installed"
    }
fi

work=$(mktemp -d)
chmod 755 "$work"
mkdir -p "$work"/{spool,state,log,munge,socket}
chmod 700 "$work/munge"

# The tasks of this cluster on a node, and the Slurm processes that mind them.
tasks_of() {
    local process parent
    for process in /proc/[0-9]*; do
        grep -zqx "SLURM_CONF=$work/slurm.conf" "$process/environ" 2>/dev/null || continue
        grep -zqx "SLURMD_NODENAME=$1" "$process/environ" 2>/dev/null || continue
        parent=$(awk '/^PPid:/ {print $2}' "$process/status" 2>/dev/null || true)
        [ "$(cat "/proc/$parent/comm" 2>/dev/null)" = slurmstepd ] && echo "$parent"
        echo "${process#/proc/}"
    done
}

end() {
    local code=$?
    set +e
    [ $code = 0 ] || tail -n 20 "$work"/log/*.log "$work"/*/store/cluster/*.log 2>/dev/null
    scancel -u "$(id -un)" 2>/dev/null && sleep 1.5
    kill -9 $(tasks_of "n[1-3]") 2>/dev/null
    pkill -9 -P $$
    sleep 0.5
    rm -rf "$work" 2>/dev/null
    exit $code
}
trap end EXIT

# Ports that nobody else uses at the moment.
free_port() {
    local port
    for port in $(shuf -i 20000-30000 -n 200); do
        (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null || { echo "$port"; return; }
    done
}

dd if=/dev/urandom of="$work/munge/key" bs=128 count=1 status=none
chmod 400 "$work/munge/key"
munged --foreground --key-file="$work/munge/key" --socket="$work/socket/munge" --pid-file="$work/munge/pid" \
    --log-file="$work/log/munge.log" --seed-file="$work/munge/seed" >/dev/null 2>&1 &
disown

user=$(id -un)
cat >"$work/slurm.conf" <<END
ClusterName=harvest
SlurmctldHost=localhost(127.0.0.1)
SlurmUser=$user
SlurmdUser=$user
SlurmctldPort=$(free_port)
AuthType=auth/munge
# A requeued task may not start before its old credential has ended: two minutes, unless told otherwise.
AuthInfo=socket=$work/socket/munge,cred_expire=5
CredType=cred/munge
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool/%n
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.%n.pid
SlurmctldLogFile=$work/log/slurmctld.log
SlurmdLogFile=$work/log/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerType=sched/builtin
SchedulerParameters=sched_interval=1,sched_min_interval=1
MpiDefault=none
ReturnToService=2
SlurmdTimeout=5
SlurmctldTimeout=5
InactiveLimit=0
KillWait=1
MinJobAge=600
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
JobRequeue=1
NodeName=n1 NodeHostname=localhost NodeAddr=127.0.0.1 Port=$(free_port) CPUs=2 RealMemory=2000 State=UNKNOWN
NodeName=n2 NodeHostname=localhost NodeAddr=127.0.0.1 Port=$(free_port) CPUs=2 RealMemory=2000 State=UNKNOWN
NodeName=n3 NodeHostname=localhost NodeAddr=127.0.0.1 Port=$(free_port) CPUs=2 RealMemory=2000 State=UNKNOWN
PartitionName=flight Nodes=n[1-3] Default=YES MaxTime=INFINITE State=UP
END
export SLURM_CONF="$work/slurm.conf"
for _ in $(seq 50); do [ -S "$work/socket/munge" ] && break; sleep 0.1; done
# Disowned: nobody is to be told of daemons that are killed on purpose.
start_node() {
    slurmd -D -N "$1" -f "$work/slurm.conf" >/dev/null 2>&1 &
    disown
}
begun=$(date +%s.%N)
slurmctld -D -i -f "$work/slurm.conf" >/dev/null 2>&1 &
disown
for node in n1 n2 n3; do start_node $node; done
for _ in $(seq 150); do [ "$(sinfo -h -t idle -o %D 2>/dev/null)" = 3 ] && break; sleep 0.1; done
[ "$(sinfo -h -t idle -o %D)" = 3 ] || { echo "the nodes did not come up"; exit 1; }
echo "three nodes up in $(echo "$(date +%s.%N) - $begun" | bc) s"

# The pipeline, with few shards and small tasks, on two flights of the demonstration: some shards have no work.
pipeline=$work/harv
cp -r pipelines/harv "$pipeline"
mkdir "$work/flights"
for flight in $(find data/demo/flights -name '*.parquet' | sort | head -n 2); do ln -s "$PWD/$flight" "$work/flights/"; done
cat >>"$pipeline/pipeline.yaml" <<END

cluster: { shards: 4, time: "00:05:00", memory_mb: 500, processors: 1, retries: 3, partition: flight }
END
tables() { (cd "$1" && find -L . -maxdepth 1 -name '*.csv' -type f | sort | xargs sha256sum); }
options() { echo "$pipeline --archive $work/flights --store $work/$1/store --reports $work/$1/reports"; }

# shellcheck disable=SC2046
"$harvest" run $(options alone) --quiet || [ $? = 2 ]
tables "$work/alone/reports" >"$work/expected"
[ -s "$work/expected" ]

# Hands the jobs over, does what is given meanwhile, waits for the merge, and compares.
campaign() {
    local name=$1 meanwhile=$2 begun job state
    begun=$(date +%s)
    # All but the first find their flights ingested and segmented: what is tried on them is the estimates.
    if [ "$name" != plain ]; then
        mkdir -p "$work/$name/store"
        cp -r "$work"/plain/store/{ingest,records,segment} "$work/$name/store/"
    fi
    # shellcheck disable=SC2046
    "$harvest" submit $(options "$name") --engine slurm --go --quiet >"$work/$name.jobs"
    job=$(awk '/^merge/ {print $2}' "$work/$name.jobs")
    $meanwhile "$name"
    for _ in $(seq 600); do
        state=$(squeue -h -j "$job" -o %T 2>/dev/null || true)
        [ -z "$state" ] && break
        sleep 0.5
    done
    [ -z "$state" ] || { squeue; echo "$name: the merge did not come to an end"; exit 1; }
    tables "$work/$name/reports" | diff "$work/expected" - || { echo "$name: other tables than one process"; exit 1; }
    # shellcheck disable=SC2046
    for plan in flights maneuvers; do
        "$harvest" status $(options "$name") --plan "$work/$name/store/$plan.plan.json" --quiet >/dev/null
    done
    echo "$name: the tables of one process, after $(($(date +%s) - begun)) s"
}

campaign plain :

# A program that asks for another try, once, in the second shard of the maneuvers.
cat >"$work/fails_once" <<END
#!/bin/bash
if [[ "\$*" == estimate*--shard\ 2/4* ]] && mkdir "$work/failed" 2>/dev/null; then
    echo "a file server that did not answer" >&2
    exit 75
fi
exec "$harvest" "\$@"
END
chmod 755 "$work/fails_once"
HARVEST="$work/fails_once" campaign transient :
[ -d "$work/failed" ] || { echo "the task did not fail"; exit 1; }
grep -q "DUE TO JOB REQUEUE\|did not answer" "$work"/transient/store/cluster/maneuvers-2.log

# Tasks that take long enough for a node to die under them; each says where it began.
cat >"$work/slow" <<END
#!/bin/bash
[[ "\$*" == estimate* ]] && { echo "\$SLURMD_NODENAME" >>"$work/began"; sleep 6; }
exec "$harvest" "\$@"
END
chmod 755 "$work/slow"
kill_node() {
    for _ in $(seq 900); do grep -q n2 "$work/began" 2>/dev/null && break; sleep 0.1; done
    grep -q n2 "$work/began" || { echo "no task came to the node that is to die"; exit 1; }
    pkill -9 -f "slurmd -D -N n2 -f $work"
    # shellcheck disable=SC2046
    kill -9 $(tasks_of n2) || true
    echo "node n2 killed under its tasks"
}
HARVEST="$work/slow" campaign node kill_node
[ "$(wc -l <"$work/began")" -gt 4 ] || { echo "no task was done again"; exit 1; }
echo "3 passed, 0 failed"
