#!/bin/bash
# Checks that t, hits and misses of rays at every shape from 1.0001 to a million radii away are within the tiers of the hard
# cases at every precision (tools/numerics/ladder.c).
. "$(dirname "$0")/support.bash"
is_sanitized && skip_all "the plain build measures the same kernels"
check "the ladder builds" $make -s BUILD="$build" ladder
rays=250
if is_long; then
    rays=1500
    check "the textbook's ladder builds" $make -s BUILD="$build-textbook" TEXTBOOK=1 ladder
    check "the textbook's spheres miss their bounds" bash -c "! '$build-textbook/tools/numerics/ladder' --rays 250 --precision single --check --shape sphere"
fi
for shape in sphere plane disc box cylinder cone triangle torus paraboloid superellipsoid; do
    check "$shape" "$build/tools/numerics/ladder" --rays $rays --check --shape $shape
done
finish
