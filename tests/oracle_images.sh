#!/bin/bash
# Compares small images of every shape and light, of mirrors and glass, at each precision, pixel by pixel with the exact oracle.
# With GLINT_LONG_TESTS=1 also larger ones of each shape by itself (some minutes).
# Takes the program from BUILD. The kernels are the same in every build, so that the first build's run is enough.
. "$(dirname "$0")/support.bash"

python_with flint=python-flint==0.9.0 yaml=PyYAML==6.0.3 numpy=numpy==2.4.6
long=
! is_long || long=--long
if "$python" -B tests/oracle/images.py "$build/glint" "$scratch" $long; then
    pass
else
    fail "images are what the oracle says"
fi
finish
