#!/bin/bash
# Runs libFuzzer 20,000 times on each reader, 100,000 on those of meshes, in long tests only. tools/fuzz does more. The readers
# are always built with clang's sanitizers, so they are the same whatever is under test.
# run_tests: sanitize-long-only
. "$(dirname "$0")/support.bash"
is_long || skip_all "only with GLINT_LONG_TESTS=1"
fuzzes() { echo 'int LLVMFuzzerTestOneInput(void) { return 0; }' | "$1" -fsanitize=fuzzer -x c - -o /dev/null 2>/dev/null; }
for CLANG in ${CLANG:-$(printf '%s\n' /usr/bin/clang-[1-9][0-9] | sort -r)}; do
    fuzzes "$CLANG" && break
    CLANG=
done
[ "$CLANG" ] || skip_all "no clang with libFuzzer is here (in Debian: clang and libclang-rt-dev)"
export CLANG
check 'every reader' env -u BUILD tools/fuzz 20000
check 'every reader of meshes' env -u BUILD tools/fuzz 100000 obj mtl ply stl gltf glb reply
finish
