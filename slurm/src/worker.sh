# One worker on one node, for a coordinator that runs elsewhere. `osteon slurm array` prints this
# below the settings, and `osteon worker slurm` submits it.

set -euo pipefail

fail() {
    printf 'osteon: %s\n' "$*" >&2
    exit 1
}

[[ -n ${SLURM_JOB_ID:-} ]] || fail "this is not a job of Slurm; submit the script by: sbatch SCRIPT"
[[ -x $osteon ]] || fail "$osteon cannot be run on $(hostname); put it where every node sees it, and print the script" \
    "again with that program, or with --program PATH"
for file in "${OSTEON_TLS_CA:-}" "${OSTEON_TLS_CERT:-}" "${OSTEON_TLS_KEY:-}" "${OSTEON_TOKEN_FILE:-}"; do
    [[ -z $file || -r $file ]] || fail "$file cannot be read on $(hostname); put it where every node sees it"
done

# Workers that began together do not end together: consecutive numbers are spread over the stagger.
lifetime=$((lifetime_s - stagger_s * (SLURM_JOB_ID * 618 % 1000) / 1000))
exec "$osteon" worker --threads "${SLURM_CPUS_ON_NODE:-1}" --time-limit "$lifetime" "${options[@]}"
