# A Slurm cluster of several nodes on this machine, for tests and measurements. To be sourced by bash.
#
#     start_cluster FOLDER NODE...   starts munged, slurmctld and a slurmd for each node, of one CPU each
#     kill_task NODE PROCESS         ends a task with SIGKILL, and the daemon of its node
#     stop_cluster                   cancels all jobs and ends all processes
#
# Everything is below FOLDER, an empty one that no other cluster uses; no configuration of this machine
# is read. The user need not be root. Ports are free ones; munge's key is made for this run.

cluster_folder=
declare -A cluster_process=()

cluster_log() { printf 'cluster: %s\n' "$*" >&2; }

# cluster_ports COUNT: prints COUNT TCP ports without a listener, below those of outgoing connections.
cluster_ports() {
    local used port count=0
    used=$(cat /proc/net/tcp /proc/net/tcp6 2>/dev/null | awk '{ split($2, part, ":"); print part[2] }')
    while [ "$count" -lt "$1" ]; do
        port=$((20000 + (RANDOM * 32768 + RANDOM) % 12000))
        ! grep -qxF "$(printf '%04X' "$port")" <<<"$used" || continue
        used+=$'\n'$(printf '%04X' "$port")
        echo "$port"
        count=$((count + 1))
    done
}

# run_daemon NAME COMMAND...: in the background, its output in a log.
run_daemon() {
    local name=$1
    shift
    "$@" </dev/null >"$cluster_folder/$name.out" 2>&1 &
    cluster_process[$name]=$!
}

configure_cluster() {
    local user host ports i=1 node
    user=$(id -un) host=$(hostname -s)
    mapfile -t ports < <(cluster_ports $(($# + 1)))
    # With ReturnToService=2 a late answer of a daemon that was killed brings its node back (Slurm 24).
    cat <<EOF
ClusterName=local
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=${ports[0]}
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$cluster_folder/munge.socket
CredType=cred/munge
StateSaveLocation=$cluster_folder/state
SlurmdSpoolDir=$cluster_folder/spool-%n
SlurmctldPidFile=$cluster_folder/slurmctld.pid
SlurmdPidFile=$cluster_folder/slurmd-%n.pid
SlurmctldLogFile=$cluster_folder/slurmctld.log
SlurmdLogFile=$cluster_folder/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
ReturnToService=1
KillWait=5
JobRequeue=1
SchedulerParameters=sched_interval=1
PartitionName=all Nodes=ALL Default=YES MaxTime=60 State=UP
EOF
    # CPUs that the machine does not have are no reason to drain a node.
    echo "SlurmdParameters=config_overrides"
    for node in "$@"; do
        echo "NodeName=$node NodeHostname=$host NodeAddr=127.0.0.1 Port=${ports[$i]} CPUs=1 State=UNKNOWN"
        i=$((i + 1))
    done
}

# are_idle COUNT: whether at least COUNT nodes wait for work.
are_idle() {
    [ "$(timeout 5 sinfo -h -N -o '%N %T' 2>/dev/null | grep -c ' idle$')" -ge "$1" ]
}

start_cluster() {
    local node attempt wait needed
    cluster_folder=$(cd "$1" && pwd -P)
    shift
    for needed in munged slurmctld slurmd sbatch; do
        PATH=$PATH:/usr/sbin command -v "$needed" >/dev/null && continue
        cluster_log "$needed is not installed; ./test installs it"
        return 4
    done
    PATH=$PATH:/usr/sbin
    chmod 700 "$cluster_folder"
    mkdir -p "$cluster_folder/state"
    (umask 077 && head -c 128 /dev/urandom >"$cluster_folder/munge.key")
    run_daemon munged munged --foreground --force --num-threads=2 --key-file="$cluster_folder/munge.key" \
        --socket="$cluster_folder/munge.socket" --pid-file="$cluster_folder/munged.pid" \
        --log-file="$cluster_folder/munged.log" --seed-file="$cluster_folder/munge.seed"
    export SLURM_CONF=$cluster_folder/slurm.conf
    for ((wait = 0; wait < 100; ++wait)); do
        [ ! -S "$cluster_folder/munge.socket" ] || break
        sleep 0.05
    done
    # Another program may take a port between the choice and its use.
    for attempt in 1 2 3; do
        configure_cluster "$@" >"$SLURM_CONF"
        run_daemon slurmctld slurmctld -D -f "$SLURM_CONF"
        for node in "$@"; do run_daemon "$node" slurmd -D -N "$node" -f "$SLURM_CONF"; done
        for ((wait = 0; wait < 100; ++wait)); do
            ! are_idle $# || return 0
            sleep 0.1
        done
        cluster_log "attempt $attempt failed"
        tail -n 3 "$cluster_folder"/*.out >&2
        end_daemons slurmctld "$@"
    done
    return 4
}

end_daemons() {
    local name
    for name in "$@"; do
        [ -n "${cluster_process[$name]:-}" ] || continue
        kill "${cluster_process[$name]}" 2>/dev/null || true
    done
    for name in "$@"; do
        [ -n "${cluster_process[$name]:-}" ] || continue
        # Bash says how a job ended that it waits for.
        { timeout 10 tail --pid="${cluster_process[$name]}" -f /dev/null ||
            kill -KILL "${cluster_process[$name]}"; } 2>/dev/null || true
        wait "${cluster_process[$name]}" 2>/dev/null || true
        unset "cluster_process[$name]"
    done
}

# task_of NODE ARGUMENT: the process of a task on the node whose command has the argument, if there is
# one. Starts no process, so that it is fast on a busy machine.
task_of() {
    local folder words
    for folder in /proc/[0-9]*; do
        mapfile -d '' -t words 2>/dev/null <"$folder/cmdline" || continue
        [[ " ${words[*]} " == *" $2 "* && ${words[0]} != *sbatch* ]] || continue
        mapfile -d '' -t words 2>/dev/null <"$folder/environ" || continue
        [[ " ${words[*]} " == *" SLURMD_NODENAME=$1 "* ]] || continue
        # Another cluster on this machine may have a node of this name.
        [[ " ${words[*]} " == *" SLURM_CONF=$SLURM_CONF "* ]] || continue
        echo "${folder#/proc/}"
        return
    done
}

kill_task() {
    local step
    step=$(awk '$1 == "PPid:" { print $2 }' "/proc/$2/status")
    kill -KILL "${cluster_process[$1]}" "$step" "$2"
    wait "${cluster_process[$1]}" 2>/dev/null || true
    unset "cluster_process[$1]"
    # Slurm would find out by itself, when the daemon no longer answers.
    scontrol update "nodename=$1" state=down reason=killed
}

# wait_for_jobs SECONDS: until the queue is empty.
wait_for_jobs() {
    local end=$((SECONDS + $1))
    while [ -n "$(timeout 5 squeue -h 2>/dev/null)" ]; do
        [ "$SECONDS" -lt "$end" ] || return 1
        sleep 0.2
    done
}

stop_cluster() {
    [ -n "$cluster_folder" ] || return 0
    if [ -n "${cluster_process[slurmctld]:-}" ] && [ -n "$(timeout 5 squeue -h 2>/dev/null)" ]; then
        timeout 10 scancel --user="$(id -un)" >/dev/null 2>&1 || true
        wait_for_jobs 15 || true
    fi
    end_daemons "${!cluster_process[@]}"
}

# left_processes: those of the cluster that still run.
left_processes() {
    local folder
    for folder in /proc/[0-9]*; do
        [ "${folder#/proc/}" != $$ ] && [ "${folder#/proc/}" != "$BASHPID" ] || continue
        [[ $(readlink "$folder/cwd" "$folder"/fd/* 2>/dev/null) == *"$cluster_folder/"* ]] || continue
        echo "${folder#/proc/} $(cat "$folder/comm" 2>/dev/null)"
    done
}
