#!/usr/bin/env bash
# Published CSV tables of an earlier revision and of the working tree, byte for byte: on the demonstration, and on ARCHIVE
# with WIND_TUNNEL where they are set. Each program runs its own pipelines/. Earlier tables are kept under target/.
#
#   tests/same_tables.sh REVISION
set -euo pipefail
cd "$(dirname "$0")/.."

revision=$(git rev-parse --short=12 --verify "${1:?an earlier revision}^{commit}")
target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
export CARGO_TARGET_DIR=$target
earlier=$target/same_tables/$revision
now=$target/same_tables/now
tree=$target/same_tables/tree
campaigns=demo
options=()
if [ -n "${ARCHIVE:-}" ]; then
    options=(--archive "$(realpath "$(dirname "$ARCHIVE")")/$(basename "$ARCHIVE")")
    [ -z "${WIND_TUNNEL:-}" ] || options+=(--wind-tunnel "$(realpath "$WIND_TUNNEL")")
    campaigns="demo archive_$(printf '%s' "${options[@]}" | cksum | cut -d ' ' -f 1)"
fi
trap 'git worktree remove --force "$tree" 2>/dev/null || true' EXIT

# Tables of a campaign by a program, into a folder. A run that rejects something ends with 2.
run() {
    local program=$1 campaign=$2 out=$3/$2 code=0
    rm -rf "$out"
    mkdir -p "$out"
    [ "$campaign" = demo ] || set -- "$@" "${options[@]}"
    shift 3
    "$program" run harv --quiet --store "$out/store" --reports "$out/reports" "$@" >"$out/log" 2>&1 || code=$?
    rm -rf "$out/store"
    [ $code = 0 ] || [ $code = 2 ] || { cat "$out/log"; exit 1; }
    touch "$out/done"
}

for campaign in $campaigns; do
    [ ! -e "$earlier/$campaign/done" ] || continue
    if [ ! -e "$tree" ]; then
        git worktree add --quiet --detach --force "$tree" "$revision"
        (cd "$tree" && cargo build --release --locked --quiet)
        cp "$target/release/harvest" "$target/same_tables/program"
    fi
    (cd "$tree" && run "$target/same_tables/program" "$campaign" "$earlier")
done

cargo build --release --locked --quiet
different=0
for campaign in $campaigns; do
    run "$target/release/harvest" "$campaign" "$now"
    for name in $( (cd "$earlier/$campaign/reports" && ls ./*.csv; cd "$now/$campaign/reports" && ls ./*.csv) | sort -u); do
        pair=("$earlier/$campaign/reports/$name" "$now/$campaign/reports/$name")
        cmp -s "${pair[@]}" && continue
        different=1
        echo "differs: $campaign/${name#./}"
        diff "${pair[@]}" 2>&1 | head -n 6 | cut -c 1-200 || true
    done
done
[ $different = 1 ] || echo "all published CSV tables have the bytes of $revision: $campaigns"
exit $different
