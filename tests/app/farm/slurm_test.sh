#!/usr/bin/env bash
# slurm_test.sh PROGRAM SCRIPT: renders a clip as a job array on a Slurm cluster of two nodes on this
# machine, by SCRIPT (render.sbatch). One node is killed in the middle of a shard; the task runs again on
# the other and keeps what is whole. The merged images are those of one run.
set -euo pipefail
program=$1 script=$2
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd -P)
. "$here/cluster.sh"

work=$(mktemp -d)
mkdir "$work/cluster"
finish() {
    local code=$?
    [ -z "${one_run:-}" ] || kill "$one_run" 2>/dev/null || true
    stop_cluster
    if [ "$code" != 0 ]; then tail -n 5 "$work"/cluster/*.log "$work"/task-* >&2 2>/dev/null || true; fi
    rm -rf "$work"
    exit "$code"
}
trap finish EXIT
fail() { echo "slurm_test: $*" >&2; exit 1; }

# A fraction of a second a frame.
scene=(builtin:cloth:3000 --frames 0..23 --size 80x60 --backend brute --rays shadow)
"$program" render "${scene[@]}" --out "$work/one" --threads 1 -q &
one_run=$!
start_cluster "$work/cluster" n1 n2 || fail "no cluster"

cd "$work"
mkdir shards
job=$(MORPHRAY=$program sbatch --parsable --array=1-4 --output="$work/task-%a.txt" "$script" \
    "${scene[@]}" --verify-every 6 --out "$work/shards")

# is_half_done SHARD: whether it runs on n2, and has written an image.
is_half_done() {
    local part=shards/part-$1-of-4.json first=$((($1 - 1) * 6))
    [ -e "$(printf 'shards/frame_%04d.png' "$first")" ] && [ -e "$part" ] &&
        grep -q '"state": "running"' "$part" && grep -q '"host": "n2"' "$part"
}

killed=
for ((i = 0; i < 1000; ++i)); do
    [ $((i % 20)) -lt 19 ] || [ -n "$(timeout 5 squeue -h)" ] || break
    for shard in 1 2 3 4; do
        is_half_done "$shard" || continue
        victim=$(task_of n2 "$shard/4")
        # It must not end while we look.
        [ -n "$victim" ] && kill -STOP "$victim" 2>/dev/null || continue
        if is_half_done "$shard"; then
            kill_task n2 "$victim"
            killed=$shard
            break 2
        fi
        kill -CONT "$victim"
    done
    sleep 0.05
done
[ -n "$killed" ] || fail "no task was killed"
! "$program" merge shards >"$work/before.txt" || fail "a killed shard is not missed"

# Slurm lets a task wait for two minutes before it runs again.
for ((i = 0; i < 200; ++i)); do
    [[ $(scontrol show job "${job}_$killed") != *Restarts=1* ]] || break
    sleep 0.1
done
scontrol update "jobid=${job}_$killed" starttime=now
wait_for_jobs 60 || fail "the jobs do not end"
wait "$one_run" || fail "the run that all are compared with failed"

"$program" merge shards --json merged.json --sheet sheet.png >merged.txt 2>&1 ||
    { cat merged.txt >&2; fail "merge finds something"; }
grep -q 'all 24 frames are there once and whole; 8 comparisons' merged.txt || { cat merged.txt >&2; fail "merge"; }
for image in one/frame_*.png; do
    cmp "$image" "shards/${image#one/}" || fail "${image#one/} differs from one run"
done
cmp one/sheet.png sheet.png || fail "the contact sheets differ"
grep -q '"kept": true' "shards/part-$killed-of-4.json" || fail "the second run kept nothing"
grep -q '"host": "n2"' "shards/part-$killed-of-4.json" || fail "the node that was killed is not named"
# The task that was killed may have been writing one.
[ "$(find shards -name '.morphray-*' | wc -l)" -le 1 ] || fail "temporary files are left"

# A task that Slurm ends early, as before the time limit, says what is left.
job=$(MORPHRAY=$program sbatch --parsable --array=1-1 --output="$work/task-ended.txt" "$script" \
    "${scene[@]:0:1}" --frames 0..24:0.03125 "${scene[@]:3}" --out "$work/ended")
for ((i = 0; i < 600; ++i)); do
    [ ! -e ended/frame_0000.00000.png ] || break
    sleep 0.1
done
scancel --signal=TERM --batch "${job}_1"
wait_for_jobs 30 || fail "SIGTERM did not end the task"
grep -q '"state": "interrupted"' ended/part-1-of-1.json && grep -q '"exit_code": 143' ended/part-1-of-1.json ||
    fail "the part does not say that the task was ended"

stop_cluster
left=$(left_processes)
[ -z "$left" ] || fail "processes are left: $left"
echo "shard $killed was killed on n2 and ended on n1"
