#!/usr/bin/env bash
# Names a Python with the packages of docs/python.md and with JSBSim, which loads the export: a virtual environment in the target
# folder, made once. Names none where it is neither there nor can be made.
set -euo pipefail
cd "$(dirname "$0")/.."

target=${CARGO_TARGET_DIR:-target}
mkdir -p "$target"
environment=$(realpath "$target")/python
if [ ! -e "$environment/complete" ]; then
    { rm -rf "$environment" && timeout 60 python3 -m venv "$environment" &&
        timeout 600 "$environment/bin/pip" install --quiet --only-binary :all: pandas pyarrow polars duckdb matplotlib jsbsim; } >&2 || {
        echo "the packages of docs/python.md and jsbsim could not be installed" >&2
        exit 0
    }
    touch "$environment/complete"
fi
echo "$environment/bin/python"
