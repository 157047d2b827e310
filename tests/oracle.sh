#!/bin/bash
# Checks the reference that glint verify and the tests compare with, in quadruple precision, against exact arithmetic, for the
# rays of the hard cases and random ones at every shape, and for the pixels of tests/exact_scenes.txt, whose images test_bounces
# compares with the reference; ten times as many with GLINT_LONG_TESTS=1. Needs python-flint, from PyPI. It runs for the first
# build only, since the plain build computes the same.
. "$(dirname "$0")/support.bash"

python_with flint=python-flint==0.9.0 yaml=PyYAML==6.0.3
check 'the program that prints answers builds' $make -s BUILD="$build" "$build/tests/oracle/answers"
long= samples=24 size='16 12'
! is_long || long=--long samples=240 size='48 36'
answers=$build/tests/oracle/answers
{ "$answers" $samples && "$answers" image $size; } >"$scratch/answers" || fail 'answers are printed'
certify() { "$python" -B tests/oracle/certify.py "$@" <"$scratch/answers"; }
if certify $long; then
    pass
else
    fail 'what the reference answers is exact'
fi

# A reference whose distances err by 2^-50, and margins twice as large, are noticed.
notices() {
    ! certify --set "$1" --spoil "$2" >"$scratch/spoiled" && grep -q "$3 is off" "$scratch/spoiled"
}
check 'a distance that is off is noticed' notices S5 1/1125899906842624 'sphere: t'
check 'a normal that is off is noticed' notices C6 1/1125899906842624 'cone: normal'
check 'a margin that is too large is noticed' notices S5 2 'sphere: margin'
check 'so is one of a paraboloid' notices Q3 2 'paraboloid: margin'
check 'a color that is off is noticed' notices prism 1/1099511627776 'pixel: color'
finish
