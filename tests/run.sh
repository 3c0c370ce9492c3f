#!/usr/bin/env bash
# All tests, then the ten slowest. Needs Rust alone: stable test programs print times once RUSTC_BOOTSTRAP is set, and it is
# set while they run only, so that nothing is built with it.
#
#   tests/run.sh             all tests
#   tests/run.sh nights::    those whose names contain a text
#
# FEATURES names features of the crate to build with, PROFILE the build: dev, or release for the code that users run.
set -uo pipefail
cd "$(dirname "$0")/.."

built=$(mktemp) log=$(mktemp)
trap 'rm -f "$built" "$log"' EXIT
cargo test --profile "${PROFILE:-dev}" --locked --features "${FEATURES:-}" --no-run 2>&1 | tee "$built" || exit 1
programs=$(sed -n 's/^ *Executable .*(\(.*\))$/\1/p' "$built")
[ -n "$programs" ] || { echo "cargo named no test program"; exit 1; }

code=0
for program in $programs; do
    RUSTC_BOOTSTRAP=1 "$program" -Z unstable-options --report-time "$@" | tee -a "$log"
    [ "${PIPESTATUS[0]}" = 0 ] || code=101
done

printf '\nthe slowest tests:\n'
sed -n 's/^test \(.*\) \.\.\. .*<\([0-9.]*\)s>$/\2 s  \1/p' "$log" | sort -rn | head -n 10
[ $code = 0 ] || echo "tests failed: see above"
exit $code
