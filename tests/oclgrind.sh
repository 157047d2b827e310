#!/bin/bash
# Images and traces of every shape under Oclgrind: no access outside a buffer, no data race, no value used before it is
# set, no wrong OpenCL call. Whatever it reports is a failure. More pixels with GLINT_LONG_TESTS=1: it interprets kernels.
. "$(dirname "$0")/support.bash"
command -v oclgrind >/dev/null || skip_all 'Oclgrind is not here'
is_sanitized && skip_all 'a sanitized program does not run under Oclgrind'

# optimised, LLVM leaves in calls that Oclgrind 21.10 does not know
oclgrind_run() {
    oclgrind --build-options -cl-opt-disable --check-api --data-races --uninitialized --log "$scratch/log" \
        "$GLINT" "$@" >"$scratch/out" 2>&1
}

# clean WHAT ARGUMENTS…: glint succeeds and Oclgrind reports nothing.
clean() {
    local what=$1
    shift
    rm -f "$scratch/log"
    if ! oclgrind_run "$@"; then
        fail "$what: glint failed"
        tail -5 "$scratch/out"
    elif [ -s "$scratch/log" ]; then
        fail "$what: Oclgrind reports:"
        head -30 "$scratch/log"
    else
        pass
    fi
}

scene=tests/scenes/every_shape.yaml
size=8x5 small=4x3
is_long && size=16x9 small=7x5
printf '0 1 -9 0 0 1\n-5 1 0 1 0 0\n1 9 -2 0 -1 0\n' >"$scratch/rays"
for lanes in 4 $(is_long && echo 1); do
    clean "render at $lanes lanes" render $scene --size $size --lanes $lanes --quiet -o "$scratch/a.png"
    clean "trace at $lanes lanes" trace $scene --rays "$scratch/rays" --lanes $lanes -o "$scratch/c.csv"
done
for lanes in 1 $(is_long && echo 4); do
    clean "strict, samples and AOVs at $lanes lanes" render $scene --size $small --samples 2 --precision strict \
        --lanes $lanes --quiet --aov t,normal,position,object,shadow,ray,path -o "$scratch/b.png"
done
clean 'double' render $scene --size $small --precision double --lanes 1 --quiet -o "$scratch/d.npy"
finish
