#!/usr/bin/env bash
# Supply chain: advisories, licences, sources and duplicate versions of the dependencies, by cargo-deny and deny.toml.
#
# cargo-deny is the one on the path, or is built from the registry once into the target folder, away from harvest's own
# dependencies: two minutes of processor time. Where it can be had neither way, the check is skipped with a line that says so;
# with CI=true that is a failure. Advisories need their database, which is no part of the registry: where it cannot be
# fetched they are skipped with a line, with CI=true too, because no commit can mend that.
set -euo pipefail
cd "$(dirname "$0")/.."

version=0.20.2
target=${CARGO_TARGET_DIR:-target}
mkdir -p "$target"
tools=$(realpath "$target")/cargo-deny-$version
deny=$(command -v cargo-deny || true)
if [ -z "$deny" ]; then
    deny=$tools/bin/cargo-deny
    if [ ! -x "$deny" ]; then
        CARGO_TARGET_DIR="$tools/build" cargo install cargo-deny --version "=$version" --locked --debug --quiet --root "$tools" || {
            echo "skipped: cargo-deny $version could not be installed"
            [ "${CI:-}" != true ] || exit 1
            exit 0
        }
        rm -rf "$tools/build"
    fi
fi

"$deny" --locked check licenses bans sources
if timeout 120 "$deny" --locked fetch db >"$tools.log" 2>&1; then
    "$deny" --locked --offline check advisories
else
    echo "skipped: the database of advisories could not be fetched ($tools.log)"
fi

# Exceptions whose last review was over a year ago.
year_ago=$(date -d '1 year ago' +%F)
sed -n 's/^reason = "\([0-9-]*\): \(.*\)"$/\1 \2/p' deny.toml | while read -r day reason; do
    [[ $day > $year_ago ]] || echo "deny.toml: the exception of $day is due for review: $reason"
done
