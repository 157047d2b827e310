#!/bin/bash
# What glint verify carries is what the exact oracle writes. Needs python-flint, from PyPI.
. "$(dirname "$0")/support.bash"

python_with flint=python-flint==0.9.0
write_tables() { "$python" -B tests/oracle/write_tables.py >"$scratch/tables.c"; }
check "the oracle runs" write_tables
check "host/verify/tables.c is what it writes" diff "$scratch/tables.c" host/verify/tables.c
finish
