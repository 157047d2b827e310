#!/bin/bash
# 20,000 runs of libFuzzer on each reader, 100,000 on those of meshes, at length only; for more: tools/fuzz. Built
# with clang's sanitizers, whatever the rest is. The same whatever is under test. run_tests: sanitize-long-only
. "$(dirname "$0")/support.bash"
clang=${CLANG:-$(sed -n 's/^CLANG ?= //p' Makefile)}
command -v "$clang" >/dev/null || skip_all "$clang is not here"
is_long || skip_all "only with GLINT_LONG_TESTS=1"
check 'every reader' env -u BUILD tools/fuzz 20000
check 'every reader of meshes' env -u BUILD tools/fuzz 100000 obj mtl ply stl gltf glb reply
finish
