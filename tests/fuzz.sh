#!/bin/bash
# A few thousand runs of libFuzzer on each reader; at length: tools/fuzz. Built with clang's sanitizers, whatever the rest is.
. "$(dirname "$0")/support.bash"
is_long || [ -x build-fuzz/fuzz ] || skip_all 'needs make fuzz, or GLINT_LONG_TESTS=1'
command -v clang-15 >/dev/null || skip_all 'clang-15 is not here'
check 'every reader' env -u BUILD tools/fuzz "$(is_long && echo 20000 || echo 300)"
finish
