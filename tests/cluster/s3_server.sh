#!/usr/bin/env bash
# Names the program of an S3-compatible server for the tests of archives and stores in an object store: s3s-fs, built from
# the registry once, away from harvest's own dependencies. Names none where it is neither there nor can be built.
set -euo pipefail
cd "$(dirname "$0")/../.."

version=0.14.1 # the newest that Rust 1.95 builds
target=${CARGO_TARGET_DIR:-target}
mkdir -p "$target"
tools=$(realpath "$target")/s3s-fs-$version
if [ ! -x "$tools/bin/s3s-fs" ]; then
    CARGO_TARGET_DIR="$tools/build" cargo install s3s-fs --version "=$version" --features binary --locked --debug --quiet \
        --root "$tools" >&2 || {
        echo "the server s3s-fs $version could not be installed" >&2
        exit 0
    }
    rm -rf "$tools/build"
fi
echo "$tools/bin/s3s-fs"
