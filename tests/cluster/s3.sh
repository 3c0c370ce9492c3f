#!/usr/bin/env bash
# Archive and store in an object store, on a real S3-compatible server on this machine's loopback: s3s-fs, built from the
# registry once, away from harvest's own dependencies. Skipped where it is neither there nor can be built; with CI=true that
# is a failure.
set -euo pipefail
cd "$(dirname "$0")/../.."

version=0.14.1 # the newest that Rust 1.95 builds
target=${CARGO_TARGET_DIR:-target}
mkdir -p "$target"
tools=$(realpath "$target")/s3s-fs-$version
if [ ! -x "$tools/bin/s3s-fs" ]; then
    CARGO_TARGET_DIR="$tools/build" cargo install s3s-fs --version "=$version" --features binary --locked --debug --quiet \
        --root "$tools" || {
        echo "skipped: the server s3s-fs $version could not be installed"
        [ "${CI:-}" != true ] || exit 1
        exit 0
    }
    rm -rf "$tools/build"
fi
HARVEST_S3_SERVER="$tools/bin/s3s-fs" cargo test --locked --features s3 --test stages -- object_store:: "$@"
