#!/bin/bash
# The page of glint accuracy in a real browser: tests/html_report.py. Debian's chromium, driven by playwright from PyPI.
. "$(dirname "$0")/support.bash"

"$GLINT" devices >/dev/null 2>&1 || skip_all "no OpenCL device"
cp scenes/spheres16.yaml "$scratch/<!--<script>&\"é.yaml"
cp scenes/spheres16.yaml "$scratch/"
cd "$scratch" || exit 1

# refuses WHAT MESSAGE PATH: a page cannot be written there, which is told before anything is measured.
refuses() {
    "$GLINT" accuracy spheres16.yaml --html "$3" >"$scratch/out" 2>"$scratch/errors"
    check "$1: exit status 1" [ $? = 1 ]
    check "$1: $2" grep -q "$2" "$scratch/errors"
    check "$1: nothing on standard output" [ ! -s "$scratch/out" ]
}
refuses "a page on standard output" "takes a file" -
refuses "a page in no folder" "nowhere/page.html" nowhere/page.html

small=(--size 120x80 --seconds 0.2)
"$GLINT" accuracy spheres16.yaml '<!--<script>&"é.yaml' "${small[@]}" --precision fast,double --html page.html \
    --json >page.json 2>"$scratch/errors"
status=$?
if grep -q 'no 64-bit floating point' "$scratch/errors"; then
    [ $failed = 0 ] || finish
    skip_all "the device has no 64-bit floating point for a reference"
fi
check "a page of two scenes: exit status $status: $(cat "$scratch/errors")" [ $status = 0 ]
# Errors a thousand times those of any device: shadows on whole spheres.
check "a page of what is crossed out" "$GLINT" accuracy spheres16.yaml "${small[@]}" --precision single --lanes 1,8 \
    --perturb 3:1000 --html crossed.html
check "something is crossed out" grep -q '"crossed_out": true' crossed.html
check "a reference of colors" "$GLINT" render spheres16.yaml --size 120x80 --precision double -o reference.npy
check "a page of what a file's colors tell" "$GLINT" accuracy spheres16.yaml "${small[@]}" --precision fast,double \
    --reference reference.npy --html colors.html

cd - >/dev/null || exit 1
if [ $failed != 0 ] || is_sanitized; then finish; fi # the pages are those of the other build
browser=$(command -v chromium) || skip_all "there is no chromium"
python_with playwright=playwright==1.65.2
check "two scenes" "$python" tests/html_report.py "$browser" "$scratch/page.html" "$scratch/page.json"
check "crossed out" "$python" tests/html_report.py "$browser" "$scratch/crossed.html"
check "colors only" "$python" tests/html_report.py "$browser" "$scratch/colors.html"
finish
