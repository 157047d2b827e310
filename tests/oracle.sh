#!/bin/sh
# What glint verify carries is what the exact oracle writes.
set -eu
cd "$(dirname "$0")/.."
PYTHON=${PYTHON:-python3}

if ! why=$("$PYTHON" -c 'import flint' 2>&1); then
    echo "the oracle needs python-flint, from PyPI, for the Python that the variable PYTHON names:"
    echo "$why" | tail -n 1
    exit 77
fi

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
"$PYTHON" -B tests/oracle/write_tables.py >"$scratch/tables.c" 2>"$scratch/log" || {
    cat "$scratch/log"
    exit 1
}
if ! diff -q "$scratch/tables.c" host/measure/verify_tables.c >/dev/null; then
    echo "host/measure/verify_tables.c is not what tests/oracle/write_tables.py writes:"
    diff "$scratch/tables.c" host/measure/verify_tables.c | head -n 20
    exit 1
fi
