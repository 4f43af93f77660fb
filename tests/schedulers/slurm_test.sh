#!/usr/bin/env bash
# slurm_test.sh POLYMORPH: a real Slurm renders 16 frames as an array of four tasks. One task is killed and queued again,
# one is told to stop early and queues itself again; the frames are then, bit for bit, those of a single process.
# Exit code 77: there is no Slurm here and none can be installed.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
export PATH=$PATH:/usr/sbin

if [[ ${1:-} != --inside ]]; then
  for program in munged slurmctld slurmd sbatch; do
    command -v "$program" >/dev/null && continue
    ((EUID == 0)) || { echo "needs slurm-wlm and munge, which only root can install"; exit 77; }
    apt-get -q install -y --no-install-recommends slurm-wlm munge >/dev/null 2>&1 || {
      echo "slurm-wlm and munge cannot be installed"; exit 77; }
  done
  # slurmd of Debian 12 does not start without it, though nothing here asks for cgroups.
  [[ -n $(ls -A /sys/fs/cgroup 2>/dev/null) ]] || { echo "no cgroup filesystem is mounted in /sys/fs/cgroup"; exit 77; }
  work=$(mktemp -d); trap 'rm -rf "$work"' EXIT
  # The test may itself run in a job; the Slurm that is started here is another.
  for name in $(compgen -e | grep '^SLURM_' || true); do unset "$name"; done
  SLURM_FOLDER=$work/slurm "$here/one_node_slurm.sh" "$0" --inside "$1" "$work"
  exit
fi

polymorph=$2 work=$3
cd "$work"
export POLYMORPH_CACHE_DIR=$work/cache
cat >scene.json <<'SCENE'
{"source": {"shape": "cube", "spheres": {"balls": 12}}, "target": {"shape": "torus", "spheres": {"balls": 12}},
 "spheres": {"fit": "none"}, "frames": {"count": 16}, "surface": {"resolution": 32}, "image": {"width": 96, "height": 72, "samples": 256}}
SCENE
fail() { echo "FAILED: $*" >&2; tail -n 20 farm/slurm/*.log >&2 || true; squeue >&2 || true; exit 1; }
state() { scontrol show job "$1" | sed -n 's/.*JobState=\([A-Z_]*\).*/\1/p' | head -n 1; }
wait_until() {  # SECONDS COMMAND...: until it succeeds
  local left=$((5 * $1)); shift
  until "$@"; do ((left-- > 0)) || fail "timed out: $*"; sleep 0.2; done
}
is() { [[ $(state "$1") == "$2" ]]; }
all_done() { [[ -z $(squeue -h -t PENDING,RUNNING,COMPLETING,CONFIGURING) ]]; }
# Slurm starts what is queued again after two minutes. It has a reason: credentials tell time in whole seconds, and a task that
# starts in the second in which it ended before is refused ("Job credential revoked") and over for good.
soon() { scontrol update "JobId=$1" StartTime=now+3; }

"$polymorph" render scene.json -o 'one/f.####.exr' -q
ids=$("$polymorph" submit slurm scene.json -o 'farm/f.####.exr' --tasks 4 --cpus 1 --mem 500M --frame-seconds 1 --minutes 30)
array=$(head -n 1 <<<"$ids")
# A signal to one task fails as long as others of its array have never started.
none_waits() { [[ -z $(squeue -h -r -j "$array" -t PENDING) ]]; }
wait_until 60 none_waits

# Told to stop early: the script passes it on, polymorph ends with 75, and the script queues the task again. Three of the four
# frames may be under way when the first is written, so it is told before.
wait_until 100 grep -qs "shard 2 of 4" "farm/slurm/scene-${array}_2.log"
scancel --batch --signal=USR1 "${array}_2" || fail "the signal did not arrive"
# A crash: the program of a task that has rendered a frame is killed. The task is queued again, and keeps the frame.
wait_until 100 test -s farm/f.0003.exr
is "${array}_3" RUNNING || fail "the third task is over before it could be killed"
job=$(scontrol show job "${array}_3" | sed -n 's/^JobId=\([0-9]*\).*/\1/p')
for process in $(pgrep -f -- "--shard 3/4"); do
  if grep -qzx "SLURM_JOB_ID=$job" "/proc/$process/environ" &&
     [[ $(readlink "/proc/$process/exe") == "$(readlink -f "$polymorph")" ]]; then
    kill -KILL "$process"
  fi
done
wait_until 60 is "${array}_3" FAILED
scontrol requeue "${array}_3"
wait_until 60 grep -qs "finished frames are whole" "farm/slurm/scene-${array}_2.log"
for task in 2 3; do
  wait_until 60 is "${array}_$task" PENDING
  soon "${array}_$task"
done

wait_until 300 all_done
"$polymorph" status 'farm/f.####.exr' scene.json || fail "frames are missing"
for file in one/f.*.exr; do
  "$polymorph" compare "farm/${file#one/}" "$file" --fail 0 --hardfail 0 --relative 0 >/dev/null || fail "$file differs"
done
[[ $(find farm -name "f.*.exr" | wc -l) == 16 && -s farm/strip.png ]] || fail "no contact sheet"
grep -q "kept in" "farm/slurm/scene-${array}_3.log" || fail "the killed task rendered all of its frames again"
echo "16 frames of 4 tasks, bit for bit those of one process"
