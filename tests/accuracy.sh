#!/bin/bash
# glint accuracy on tiny pictures: its figures against those of tests/accuracy_reference.py, which works them out from the
# saved arrays; a reference from a file; what cannot be had. Nothing is asked of the times themselves.
. "$(dirname "$0")/support.bash"

"$GLINT" devices >/dev/null 2>&1 || skip_all "no OpenCL device"
python_with numpy

scene=scenes/mirror-glass.yaml
small=(--size 96x64 --seconds 0.2)
"$GLINT" accuracy "$scene" scenes/article.yaml "${small[@]}" --precision fast,double --save "$scratch/saved" --json \
    >"$scratch/report" 2>"$scratch/errors"
status=$?
if grep -q 'no 64-bit floating point' "$scratch/errors"; then
    [ $status = 1 ] || fail "without a reference: exit status $status, expected 1"
    skip_all "the device has no 64-bit floating point for a reference"
fi
[ $status = 0 ] || { fail "exit status $status: $(cat "$scratch/errors")"; finish; }
check "nothing on standard error" cmp "$scratch/errors" /dev/null
check "every figure is what numpy makes of the arrays" "$python" tests/accuracy_reference.py "$GLINT" "$scratch/report"

# holds WHAT PYTHON: the expression is true of `scene`, the first scene of $scratch/out, and `variants`, its variants.
holds() {
    check "$1" "$python" -c '
import json, sys
report = json.load(open(sys.argv[1]))
scene = report["scenes"][0]
variants = scene["variants"]
assert eval(sys.argv[2]), json.dumps(report, indent=1)' "$scratch/out" "$2"
}

cp "$scratch/report" "$scratch/out"
holds "the reference is no variant with errors of 0" \
    '[v["status"] for v in variants] == ["measured", "reference"] and "errors" not in variants[1] and variants[1]["frame_ms"]["runs"] > 0'
holds "glass bends paths" 'variants[0]["errors"]["path"]["edge"] > 0 and scene["edges"]["path"] > scene["edges"]["silhouette"]'

# run WANT WHAT ARGUMENTS…: the exit status of glint accuracy, whose output is kept in $scratch/out.
run() {
    local want=$1 what=$2 got
    shift 2
    "$GLINT" accuracy "$@" >"$scratch/out" 2>"$scratch/errors"
    got=$?
    if [ $got = "$want" ]; then pass; else fail "$what: exit status $got, expected $want: $(cat "$scratch/errors")"; fi
}

# The reference's own file: what is compared in colors is as before, and no count is made up.
run 0 "a reference from a file" "$scene" "${small[@]}" --precision fast,double --json \
    --reference "$scratch/saved/0-mirror-glass-reference.color.npy"
holds "colors only" 'all(variants[0]["errors"][kind]["status"] == "unavailable" for kind in
    ("object", "shadow", "path", "shading", "t", "normal")) and scene["edges"]["status"] == "unavailable"'
holds "double is measured against a file, and is the same to the last bit" \
    'variants[1]["errors"]["image"]["rmse"] == 0 and variants[1]["errors"]["image"]["psnr"] is None'
check "the same picture, so the same figures" "$python" -c '
import json, sys
one, other = (json.load(open(path))["scenes"][0]["variants"][0]["errors"]["image"] for path in sys.argv[1:])
assert one == other, (one, other)' "$scratch/report" "$scratch/out"

# Fewer samples are an error like any other; lanes other than the device's own change nothing.
run 0 "samples" scenes/article.yaml "${small[@]}" --precision double --lanes 1,4 --samples 1,8 --json
holds "samples" 'scene["reference"]["samples"] == 8 and all(
    (v["errors"]["image"]["rmse"] > 1e-3) == (v["samples"] == 1) for v in variants if v["status"] == "measured")'

run 0 "the table" scenes/article.yaml "${small[@]}" --precision double
check "the table names the reference" grep -q 'double .* the reference' "$scratch/out"
check "the fastest within a budget" grep -q '^  for an error of at most 1e-06: double, .* ms, the reference itself$' "$scratch/out"

refuse() {
    run 1 "$*" "$@"
    if [ -s "$scratch/errors" ] && ! [ -s "$scratch/out" ]; then pass; else fail "glint accuracy $*: what was said"; fi
}
refuse
refuse scenes/none.yaml
refuse "$scene" --samples 1,0
refuse "$scene" --reference "$scratch/none.npy"
refuse "$scene" --size 64x48 --reference "$scratch/saved/0-mirror-glass-reference.color.npy"
refuse "$scene" --size 96x64 --reference "$scratch/saved/0-mirror-glass-reference.t.npy"
refuse "$scene" --reference docs/demo.png
refuse "$scene" scenes/article.yaml --reference "$scratch/saved/0-mirror-glass-reference.color.npy"
refuse "$scene" --size 8x8 --save "$scratch/errors/folder"
finish
