#!/usr/bin/env bash
# Instructions of six cases, counted by valgrind: unlike times they hardly depend on the machine and its load. Needs valgrind,
# which is installed where that is possible. Skipped without it; with CI=true that is a failure.
#
#   tests/count.sh HARVEST          write the counts into the table of docs/performance.md
#   tests/count.sh HARVEST check    fail where a case is more than 5 % above that table
set -euo pipefail
cd "$(dirname "$0")/.."

harvest=$(realpath "${1:?the program: target/release/harvest}")
mode=${2:-write}
page=docs/performance.md
most_above_pct=5

if ! command -v valgrind >/dev/null && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    { timeout 120 apt-get update && timeout 300 apt-get install -y --no-install-recommends valgrind; } >/dev/null 2>&1 || true
fi
if ! command -v valgrind >/dev/null; then
    echo "skipped: no valgrind here, and it cannot be installed"
    [ "${CI:-}" != true ] || exit 1
    exit 0
fi

work=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$work"' EXIT

# Runs a command; 2 is the code of a run that rejected something.
run() {
    local out="$work/out.$BASHPID"
    "$@" >"$out" 2>&1 || [ $? = 2 ] || { cat "$out" >&2; return 1; }
}

# count CASE COMMAND...: writes the command's instructions, in millions, to a file of the case.
count() {
    local log="$work/$1.log"
    shift
    run valgrind --tool=cachegrind --cache-sim=no --cachegrind-out-file=/dev/null --log-file="$log" "$@"
    sed -n 's/.*I *refs: *//p' "$log" | tr -d , | awk '{ printf "%.0f\n", $1 / 1e6 }' >"${log%.log}.count"
}

# Options of a campaign: its archive and a store of its own; the third argument names its reports.
campaign() {
    echo "--quiet --threads 1 --archive $2 --wind-tunnel data/demo/wt_tables.csv --store $work/$1 --reports $work/$1.$3"
}

flights='data/demo/flights/*.parquet'

# shellcheck disable=SC2046 # options without spaces
one_flight() {
    for stage in ingest segment estimate; do
        count $stage "$harvest" $stage $(campaign flight data/demo/flights/flight_001.parquet reports)
    done
}

# Posterior and trends of the demonstration, whose maneuvers are estimated before.
# shellcheck disable=SC2046
trends() {
    run "$harvest" estimate $(campaign trends "$flights" estimates)
    count trend "$harvest" trend $(campaign trends "$flights" trends)
}

# Report of the demonstration, whose proof of match is made before.
# shellcheck disable=SC2046
report() {
    run "$harvest" match $(campaign report "$flights" matches)
    count report "$harvest" report $(campaign report "$flights" report)
}

set -f # the pattern of the archive is the program's to expand
running=()
for cases in one_flight trends report; do
    $cases &
    running+=($!)
done
count standard_case "$harvest" lab bench tests/data/standard_case.json --repetitions 0 --threads 1
for process in "${running[@]}"; do
    wait "$process"
done

failed=0
while IFS='|' read -r _ name _ committed _; do
    name=$(tr -d ' `' <<<"$name") committed=$(tr -d ' ,' <<<"$committed")
    [ -f "$work/$name.count" ] || continue
    counted=$(<"$work/$name.count")
    echo "$name: $counted million instructions, $committed in $page"
    if [ "$mode" = check ]; then
        [ $((counted * 100)) -le $((committed * (100 + most_above_pct))) ] || { echo "$name: more than $most_above_pct % above"; failed=1; }
    else
        sed -i "s/^\(| \`$name\` |.*| \)[0-9]*\( |\)\$/\1$counted\2/" "$page"
    fi
done < <(grep '^| `' "$page")
exit $failed
