#!/bin/bash
# Runs images and traces of every shape under Oclgrind. They must have no access outside a buffer, no data race, no value used
# before it is set, and no wrong OpenCL call. Whatever Oclgrind reports is a failure. Since it interprets kernels, more pixels,
# and each shape, light and type of material alone, need GLINT_LONG_TESTS=1.
. "$(dirname "$0")/support.bash"
command -v oclgrind >/dev/null || skip_all 'Oclgrind is not here'
is_sanitized && skip_all 'a sanitized program does not run under Oclgrind'

# optimized, LLVM leaves in calls that Oclgrind 21.10 does not know
uninitialized=--uninitialized
oclgrind_run() {
    oclgrind --build-options -cl-opt-disable --check-api --data-races $uninitialized --log "$scratch/log" \
        "$GLINT" "$@" >"$scratch/out" 2>&1
}

# clean WHAT ARGUMENTS…: checks that glint succeeds and Oclgrind reports nothing.
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
size=4x3 small=4x3
is_long && size=16x9 small=7x5
# The passports of both numbers of lanes are kept for the runs that follow. Oclgrind's checks slow them fivefold, so only
# long tests check their kernel.
if ! is_long; then
    oclgrind --build-options -cl-opt-disable "$GLINT" devices --probe >/dev/null
    oclgrind --build-options -cl-opt-disable "$GLINT" render $scene --size 1x1 --lanes 4 --quiet -o "$scratch/p.png"
fi
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
is_long || finish

# alone LIGHT OBJECT OPTION…: renders a scene of both, with the materials of every_shape.yaml.
alone() {
    local light=$1 object=$2
    shift 2
    {
        sed '/^lights:/,$d' $scene
        printf 'lights:\n%s\n' "$light"
        sed -n '/^materials:/,/^objects:/p' $scene
        printf '%s\n' "$object"
    } >"$scratch/alone.yaml"
    clean "$light $object $*" render "$scratch/alone.yaml" --size $small --quiet "$@" -o "$scratch/e.png"
}

point=$(grep -m 1 '^  - point:' $scene) sphere=$(grep -m 1 '^  - sphere:' $scene)
while read -r object; do
    alone "$point" "  $object" --lanes 4
done < <(sed '1,/^objects:/d' $scene)
while read -r light; do
    alone "  $light" "$sphere" --lanes 4
done < <(sed -n '/^lights:/,/^materials:/{/^  - [ds]/p}' $scene)
alone "$point" '  - sphere: {center: [0.6, 2, -10.2], radius: 1, material: matt}' --lanes 4
for precision in single double certified; do
    clean "with a BVH at $precision" render $scene --size $small --bvh on --precision $precision --quiet -o "$scratch/f.png"
done
# its check of values ends Oclgrind 21.10 at a frexp
uninitialized=
cp scenes/images/globe.png "$scratch"
alone "$point" '  - sphere: {center: [0, 1, 0], radius: 2, material: {image: globe.png}}' --lanes 4
finish
