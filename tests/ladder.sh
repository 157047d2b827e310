#!/bin/bash
# Rays at every shape from 1.0001 to a million radii away: t, hits and misses within the tiers of the hard cases at every
# precision (tools/numerics/ladder.c).
. "$(dirname "$0")/support.bash"
is_sanitized && skip_all "the plain build measures the same kernels"
build=${BUILD:-build}
make=${MAKE:-make}
check "the ladder builds" $make -s BUILD="$build" ladder
rays=250
is_long && rays=1500
for shape in sphere plane disc box cylinder cone triangle torus paraboloid; do
    check "$shape" "$build/tools/numerics/ladder" --rays $rays --check --shape $shape
done
finish
