#!/bin/bash
# The oracle that glint verify carries for its pictures, in long double, against the exact one, on the cases' own
# questions; and pixels of the cases' pictures, their objects, shadows and colors, over mirrors and glass.
# With GLINT_LONG_TESTS=1 ten times as many. Takes the program from BUILD, for the first build alone.
. "$(dirname "$0")/support.bash"
build=${BUILD:-build}
is_sanitized && skip_all "the plain build computes the same"
"$build/glint" devices >/dev/null 2>&1 || skip_all "no OpenCL device"

python_with flint=python-flint==0.9.0 yaml=PyYAML==6.0.3 numpy=numpy==2.4.6
check 'the overhearing glint verify builds' ${MAKE:-make} -s BUILD="$build" overhear
long=
[ "${GLINT_LONG_TESTS-}" != 1 ] || long=--long
overheard() { "$python" -B tests/oracle/overheard.py "$build/tools/numerics/overhear" "$scratch" "$@"; }
if overheard $long; then
    pass
else
    fail 'what verify takes for exact is exact, and its pictures are'
fi

# An oracle whose distances err by 2^-50 and margins by 2^-30, and pictures that err by 2^-20, are noticed.
notices() {
    ! overheard --cases "$1" --spoil "$2" >"$scratch/spoiled" && grep -q "$3" "$scratch/spoiled"
}
check 'a distance that is off is noticed' notices R1 1/1125899906842624 'sphere: t is off'
check 'a margin that is off is noticed' notices T5 1/1073741824 'torus: margin is off'
check 'a picture that is off is noticed' notices R2 1/1048576 'R2 double: [1-9]'
finish
