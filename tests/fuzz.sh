#!/bin/bash
# 300 runs of libFuzzer on each reader, 20,000 at length; for more: tools/fuzz. Built with clang's sanitizers, whatever the rest is.
# The same whatever is under test. run_tests: sanitize-long-only
. "$(dirname "$0")/support.bash"
clang=${CLANG:-$(sed -n 's/^CLANG ?= //p' Makefile)}
command -v "$clang" >/dev/null || skip_all "$clang is not here"
runs=300
if is_long; then
    runs=20000
else
    export CORPUS=$scratch/corpus # what has grown would use up the runs before any input is changed
fi
check 'every reader' env -u BUILD tools/fuzz $runs
finish
