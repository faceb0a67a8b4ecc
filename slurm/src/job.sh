# One job in one allocation: a coordinator on the first node, a worker on every node, and a client
# that submits the job and writes its results. `osteon slurm script` prints this below the settings.

set -euo pipefail
unset OSTEON_COORDINATOR OSTEON_TLS_CA OSTEON_TLS_CERT OSTEON_TLS_KEY OSTEON_TOKEN_FILE

client='' workers='' coordinator='' reason='' private=''
# The longest orderly end of each process, in seconds; together less than --stop-before.
client_s_max=10 workers_s_max=20 coordinator_s_max=20

say() { printf 'osteon: %s\n' "$*" >&2; }

fail() {
    say "$*"
    exit 1
}

runs() { [[ -n $1 ]] && kill -0 "$1" 2>/dev/null; }

# Lets a trap run at once, which it does not do during a command.
pause() {
    sleep 1 &
    wait "$!" || true
}

# Asks a process to end and waits for it, at most so many seconds. The processes of a step are asked
# through Slurm, because `srun` kills them when it receives a signal itself.
end() {
    local process=$1 seconds=$2 step=''
    runs "$process" || return 0
    if [[ -n ${3:-} ]] && read -r step <"$private/$3.step"; then
        # It may say that there is no such step after it has signalled it.
        timeout 10 scancel --quiet --signal=TERM "$SLURM_JOB_ID.$step" 2>/dev/null || true
    else
        kill -TERM "$process" 2>/dev/null || true
    fi
    for ((; seconds > 0; seconds--)); do
        runs "$process" || return 0
        pause
    done
    say "process $process did not end in time and is killed"
    kill -KILL "$process" 2>/dev/null || true
}

# Workers answer or return their batches before the coordinator closes its store.
end_all() {
    end "$client" "$client_s_max"
    end "$workers" "$workers_s_max" workers
    end "$coordinator" "$coordinator_s_max" coordinator
    if [[ -n $private ]]; then rm -rf -- "$private" || say "delete $private, which holds a token"; fi
}

requeue() {
    say "the time limit is near: stopping. What has been computed is in $store"
    end_all
    trap - EXIT
    ((restarts < requeues_max)) || fail "not queued again: this job has been requeued $restarts times, and at most" \
        "$requeues_max are allowed (--max-requeues). Submit the same script again to continue"
    timeout 60 scontrol requeue "$SLURM_JOB_ID" || fail "Slurm does not requeue the job; submit the same script again to continue"
    # Slurm ends this process now.
    sleep 60
    exit 0
}

restarts=${SLURM_RESTART_COUNT:-0}
[[ -n ${SLURM_JOB_ID:-} ]] || fail "this is not a job of Slurm; submit the script by: sbatch SCRIPT"
[[ -x $osteon ]] || fail "$osteon cannot be run on $(hostname); put it where every node sees it, and print the script" \
    "again with that program, or with --program PATH"
((restarts <= requeues_max)) || fail "this job has been requeued $restarts times, and at most $requeues_max are" \
    "allowed (--max-requeues). What has been computed is in $store: submit the same script again to continue"

trap end_all EXIT
trap 'reason=${reason:-limit}' USR1
trap 'reason=${reason:-ended}' TERM INT

mkdir -p -- "$store"
# Left by an allocation whose node failed.
rm -rf -- "$store/slurm-$SLURM_JOB_ID"
private=$store/slurm-$SLURM_JOB_ID
# The name by which the other nodes reach this one.
host=${OSTEON_HOST:-$(hostname)}
"$osteon" certs "$private" --host "$host" >/dev/null
"$osteon" token slurm --role submit --out "$private/token" --tokens "$private/tokens"
rm -- "$private/ca-key.pem" "$private/client.pem" "$private/client-key.pem"

# Every step notes its number, by which it is ended.
# shellcheck disable=SC2016
step='[[ $SLURM_PROCID != 0 ]] || printf "%s\n" "$SLURM_STEP_ID" >"$0"; exec "$@"'
touch -- "$private/url" "$private/coordinator.step" "$private/workers.step"
srun --overlap --nodes=1 --ntasks=1 --nodelist="$SLURMD_NODENAME" --cpu-bind=none \
    bash -c "$step" "$private/coordinator.step" "$osteon" coordinator --listen 0.0.0.0:0 --store "$store" \
    --tokens "$private/tokens" --tls-ca "$private/ca.pem" --tls-cert "$private/server.pem" --tls-key "$private/server-key.pem" \
    >"$private/url" &
coordinator=$!
url=''
for ((i = 0; i < start_s_max; i++)); do
    # Fails until the whole line has been written.
    if IFS= read -r url <"$private/url"; then break; fi
    runs "$coordinator" || fail "the coordinator did not start; its message is above"
    [[ -z $reason ]] || break
    url=''
    pause
done
[[ -n $url || -n $reason ]] || fail "the coordinator has not started within $start_s_max s"

if [[ -z $reason ]]; then
    export OSTEON_COORDINATOR=$url OSTEON_TLS_CA=$private/ca.pem
    OSTEON_TLS_CERT=$private/worker.pem OSTEON_TLS_KEY=$private/worker-key.pem \
        srun --overlap --kill-on-bad-exit=0 --wait=0 --cpu-bind=none \
        --nodes="$SLURM_JOB_NUM_NODES" --ntasks="$SLURM_JOB_NUM_NODES" --ntasks-per-node=1 \
        bash -c "$step" "$private/workers.step" \
        bash -c 'exec "$0" worker --threads "$SLURM_CPUS_ON_NODE" --give-up-after 120' "$osteon" &
    workers=$!
    # The request id is in $out, and the same at every start, so the job continues.
    "$osteon" "$command" "$job" --out "$out" --name "$name" --token-file "$private/token" &
    client=$!
fi

while [[ -z $reason ]] && runs "$client"; do
    runs "$coordinator" || fail "the coordinator has ended; its message is above"
    runs "$workers" || fail "all workers have ended; their messages are above"
    pause
done
case $reason in
limit) requeue ;;
ended) fail "ended by Slurm. What has been computed is in $store: unless Slurm queues the job again by itself," \
    "submit the same script again to continue" ;;
esac
status=0
wait "$client" || status=$?
exit "$status"
