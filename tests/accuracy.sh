#!/bin/bash
# glint accuracy on tiny pictures: its figures against those of tests/accuracy_reference.py, which works them out from the
# saved arrays; a reference from a file; what cannot be had. Nothing is asked of the times themselves.
. "$(dirname "$0")/support.bash"

"$GLINT" devices >/dev/null 2>&1 || skip_all "no OpenCL device"
python_with numpy=numpy==2.4.6 flip_evaluator=flip-evaluator==1.7

scene=scenes/mirror-glass.yaml
small=(--size 96x64 --seconds 0.2)
"$GLINT" accuracy "$scene" scenes/spheres16.yaml scenes/far.yaml "${small[@]}" --precision single,double \
    --save "$scratch/saved" --json >"$scratch/report" 2>"$scratch/errors"
status=$?
if grep -q 'no 64-bit floating point' "$scratch/errors"; then
    [ $status = 1 ] || fail "without a reference: exit status $status, expected 1"
    skip_all "the device has no 64-bit floating point for a reference"
fi
[ $status = 0 ] || { fail "exit status $status: $(cat "$scratch/errors")"; finish; }
check "nothing on standard error" cmp "$scratch/errors" /dev/null
check "every figure is what numpy makes of the arrays" "$python" tests/accuracy_reference.py "$scratch/report"

# holds WHAT PYTHON: the expression is true of `scene`, the first scene of $scratch/out, and `variants`, its variants.
holds() {
    check "$1" "$python" -c '
import json, sys
report = json.load(open(sys.argv[1]))
scene = report["scenes"][0]
variants = scene["variants"]
assert eval(f"({sys.argv[2]})"), json.dumps(report, indent=1)' "$scratch/out" "$2"
}

cp "$scratch/report" "$scratch/out"
holds "the reference is no variant with errors of 0" \
    '[v["status"] for v in variants] == ["measured", "reference"] and "errors" not in variants[1] and variants[1]["frame_ms"]["runs"] > 0'
holds "glass bends paths" 'scene["edges"]["path"] > scene["edges"]["silhouette"]'

holds "single is enough for an easy scene, and for one millions of units from the origin" 'all(
    not v["crossed_out"] and v["errors"]["object"]["away"] == v["errors"]["shadow"]["away"] == 0 and
    v["errors"]["shading"]["rmse"] < 1e-6
    for easy in report["scenes"][1:] for v in easy["variants"] if v["status"] == "measured")'

# run WANT WHAT ARGUMENTS…: the exit status of glint accuracy, whose output is kept in $scratch/out.
run() {
    local want=$1 what=$2 got
    shift 2
    "$GLINT" accuracy "$@" >"$scratch/out" 2>"$scratch/errors"
    got=$?
    if [ $got = "$want" ]; then pass; else fail "$what: exit status $got, expected $want: $(cat "$scratch/errors")"; fi
}

run 0 "paths that part" tests/scenes/mirror-balls.yaml "${small[@]}" --bounces 16 --precision single,double --json
holds "paths that part are counted" 'variants[0]["errors"]["path"]["edge"] > 0'

# The reference's own file: what is compared in colors is as before, and no count is made up.
run 0 "a reference from a file" "$scene" "${small[@]}" --precision single,double --json \
    --reference "$scratch/saved/0-mirror-glass-reference.color.npy"
holds "colors only" 'all(variants[0]["errors"][kind]["status"] == "unavailable" for kind in
    ("object", "shadow", "path", "shading", "t", "normal")) and scene["edges"]["status"] == "unavailable"'
holds "double is measured against a file, and is the same to the last bit" \
    'variants[1]["errors"]["image"]["rmse"] == 0 and variants[1]["errors"]["image"]["psnr"] is None'
check "the same picture, so the same figures" "$python" -c '
import json, sys
one, other = (json.load(open(path))["scenes"][0]["variants"][0]["errors"]["image"] for path in sys.argv[1:])
assert one == other, (one, other)' "$scratch/report" "$scratch/out"

# Fewer samples are an error like any other.
run 0 "samples" scenes/article.yaml "${small[@]}" --precision double --lanes 1 --samples 1,8 --json
holds "samples" 'scene["reference"]["samples"] == 8 and all(
    (v["errors"]["image"]["rmse"] > 1e-3) == (v["samples"] == 1) for v in variants if v["status"] == "measured")'

run 0 "the table" scenes/article.yaml "${small[@]}" --precision double
check "the table names the reference" grep -q 'double .* the reference' "$scratch/out"
check "the fastest within a budget" grep -q '^  for an error of at most 1e-06: double, .* ms, the reference itself$' "$scratch/out"

# A float counts in half meters on this planet: what stands on it sinks in or floats where the eye is 1.7 m above it.
sed 's/2000002, 2999995/2000001.7, 2999995/' scenes/far-planet.yaml >"$scratch/planet.yaml"
run 0 "a scene beyond single precision" "$scratch/planet.yaml" "${small[@]}" --precision single --json
holds "single is crossed out, and not picked" 'variants[0]["crossed_out"] and
    variants[0]["errors"]["shadow"]["away"] > 0 and variants[0]["pareto"] == dict.fromkeys(variants[0]["pareto"], False) and
    [pick["variant"] for pick in scene["picks"]] == [None, None, None]'

# What errs is the variants; the reference, its arrays to the last bit, is as it was.
run 0 "errors injected" "$scene" "${small[@]}" --precision double --perturb 1:1000 --save "$scratch/perturbed" --json
holds "what errs is no reference" 'report["perturb"] == {"seed": 1, "scale": 1000} and
    variants[0]["status"] == "measured" and variants[0]["kernel_hash"] != scene["reference"]["kernel_hash"]'
check "the reference does not err" cmp "$scratch"/{saved,perturbed}/0-mirror-glass-reference.color.npy

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
