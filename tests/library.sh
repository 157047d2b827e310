#!/bin/bash
# run_tests: sanitize-long-only
# Tests libglint as a C program finds it: installed, with nothing else of the tree. The example builds against the shared and the
# static library, as C and as C++, and both have the symbols of glint.h alone.
. "$(dirname "$0")/support.bash"
is_sanitized && skip_all "the example has no sanitizer's runtime"

stage=$scratch/stage
check "make install-library" $make -s BUILD="$build" PREFIX="$stage" DOCDIR="$stage/doc" install-library
listed() { sed -n 's/^    \(glint_[a-z_]*\);$/\1/p' host/api/symbols | sort; }
check "the header declares what symbols lists" diff <(listed) \
    <(grep -o 'glint_[a-z_]*(' "$stage/include/glint.h" | tr -d '(' | sort -u)
exported() { nm "$@" | sed -n 's/.* T \(.*\)/\1/p' | sed 's/@.*//' | sort; }
check "the shared library exports these alone" diff <(exported -D --defined-only "$stage/lib/libglint.so") \
    <(listed)
check "the static library exports the same" diff <(nm -g --defined-only "$stage/lib/libglint.a" | sed -n 's/.* [A-Z] //p' | sort) \
    <(listed)

# Only crash handling, exit() and constants that are computed once need process-wide variables. Only faults print.
check "libglint has no other process-wide variables" diff <(nm "$stage/lib/libglint.a" | sed -n 's/.* [bB] \([a-z_0-9]*\).*/\1/p' | sort -u) \
    <(printf '%s\n' c_locale calling_threads complete_status crash_record curve_16 curve_8 is_complete last_call \
        limits current_call current_kernel once once_16 once_8 pending pending_mutex stack | sort)
check "only faults print to stderr" test "$(cd host && grep -rlwE --include='*.c' 'stderr|perror' base image opencl scene import compile render api)" = base/fault.c

# Compiles in the stage, where the tree is out of sight.
cp scenes/article.yaml "$scratch/scene.yaml"
cd "$stage/doc/docs"
export PKG_CONFIG_PATH=$stage/lib/pkgconfig LD_LIBRARY_PATH=$stage/lib
flags="-Wall -Wextra -Werror"
check "the example compiles" ${CC:-cc} -std=c11 $flags example.c $(pkg-config --cflags --libs glint) -lm -o "$scratch/shared"
check "it compiles with the static library" ${CC:-cc} -std=c11 $flags example.c $(pkg-config --cflags glint) "$stage/lib/libglint.a" \
    $(pkg-config --libs --static glint | sed 's/-lglint//') -lm -o "$scratch/static"
! command -v c++ >/dev/null || check "the header compiles as C++" c++ -x c++ -fsyntax-only $flags -include "$stage/include/glint.h" /dev/null
cd "$scratch"
for program in shared static; do
    ./$program scene.yaml $program.ppm >$program.txt 2>/dev/null
    check "the $program example compares, float being close to double" grep -qxE "RMSE [1-9][.0-9]*e-0[4-7], mean FLIP [1-9][.0-9]*e-0[5-9]" $program.txt
    check "it traces" test "$(tail -n 2 $program.txt)" = "object 1, t from 3.5511868 to 3.55119538, certain
nothing before t = 3.5"
done
check "both images are the same" cmp shared.ppm static.ppm
check "the image has its size" test "$(head -c 14 shared.ppm)" = "P6 320 180 255"
check "a wrong scene ends it with the message" grep -q 'nowhere.yaml.*No such file' <(./shared nowhere.yaml image.ppm 2>&1)
check "a full disk ends it with the message" grep -q '/dev/full: No space left' <(./shared scene.yaml /dev/full 2>&1)
finish
