#!/bin/bash
# 20,000 runs of libFuzzer on each reader, at length only: 40 s for 300 of each, most of them to build; for more: tools/fuzz. Built
# with clang's sanitizers, whatever the rest is. The same whatever is under test. run_tests: sanitize-long-only
. "$(dirname "$0")/support.bash"
clang=${CLANG:-$(sed -n 's/^CLANG ?= //p' Makefile)}
command -v "$clang" >/dev/null || skip_all "$clang is not here"
is_long || skip_all "only with GLINT_LONG_TESTS=1"
check 'every reader' env -u BUILD tools/fuzz 20000
finish
