#!/usr/bin/env bash
# one_node_slurm.sh COMMAND...: runs COMMAND beside a Slurm of this one machine, without systemd, cgroups or accounting.
# All of it lies in a folder of its own ($SLURM_FOLDER, default: a new one), and only what was started here is stopped.
set -euo pipefail
D=${SLURM_FOLDER:-$(mktemp -d)}; H=$(hostname -s); ME=$(id -un)
PORT=${SLURM_PORT:-$((20000 + $$ % 5000 * 2))}  # and the next one
PATH=$PATH:/usr/sbin
start() {
  mkdir -p "$D"/{ctld,d,log,run}; chmod 755 "$D" "$D/run" "$D/log"
  [ -f "$D/munge.key" ] || { (umask 077; head -c 128 /dev/urandom >"$D/munge.key"); chmod 400 "$D/munge.key"; }
  # AuthInfo and munged's options: an own key and socket, so that nothing of the system's is touched. linuxproc, task/none
  # and jobacct_gather/none are what needs no cgroups. The ports are not Slurm's own, for one may run here already, or this test twice. The node
  # says that it has four processors (config_overrides), so that an array of four starts at once on two as well.
  cat >"$D/slurm.conf" <<CONFIGURATION
ClusterName=onenode
SlurmctldHost=$H(127.0.0.1)
SlurmUser=$ME
SlurmdUser=$ME
AuthType=auth/munge
AuthInfo=socket=$D/run/munge.sock
CredType=cred/munge
SlurmctldPort=$PORT
SlurmdPort=$((PORT + 1))
StateSaveLocation=$D/ctld
SlurmdSpoolDir=$D/d
SlurmctldPidFile=$D/run/slurmctld.pid
SlurmdPidFile=$D/run/slurmd.pid
SlurmctldLogFile=$D/log/slurmctld.log
SlurmdLogFile=$D/log/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/filetxt
JobCompLoc=$D/log/jobcomp.log
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerType=sched/builtin
SchedulerParameters=batch_sched_delay=0,sched_interval=1
ReturnToService=2
SlurmctldTimeout=30
SlurmdTimeout=300
SlurmdParameters=config_overrides
KillWait=10
MpiDefault=none
JobRequeue=1
MinJobAge=3600
NodeName=$H NodeAddr=127.0.0.1 CPUs=4 RealMemory=4000 State=UNKNOWN
PartitionName=main Nodes=$H Default=YES MaxTime=INFINITE State=UP
CONFIGURATION
  export SLURM_CONF="$D/slurm.conf"
  munged --foreground --force --key-file="$D/munge.key" --socket="$D/run/munge.sock" --pid-file="$D/run/munged.pid" \
    --log-file="$D/log/munged.log" --seed-file="$D/run/munge.seed" >"$D/log/munged.out" 2>&1 &
  MUNGED=$!
  for _ in $(seq 300); do munge -S "$D/run/munge.sock" -n >/dev/null 2>&1 && break; sleep 0.1; done
  slurmctld -D -c >"$D/log/slurmctld.out" 2>&1 & CTLD=$!
  for _ in $(seq 300); do grep -q UP < <(scontrol ping 2>/dev/null) && break; sleep 0.1; done
  slurmd -D -N "$H" >"$D/log/slurmd.out" 2>&1 & SLURMD=$!
  for _ in $(seq 300); do grep -q '^idle$' < <(sinfo -h -o %t 2>/dev/null) && return 0; sleep 0.1; done
  echo "slurm did not come up:" >&2; tail -n 5 "$D"/log/*.out >&2; return 1
}
stop() {
  for p in ${SLURMD:-} ${CTLD:-} ${MUNGED:-}; do
    kill -TERM "$p" 2>/dev/null || continue
    wait "$p" 2>/dev/null || true
  done
}
trap stop EXIT
start
"$@"
