#!/bin/bash
# Each command's JSON has the members that docs/json.md lists, and no others, of the types it says.
. "$(dirname "$0")/support.bash"

"$GLINT" devices >/dev/null 2>&1 || skip_all "no OpenCL device"
command -v python3 >/dev/null || skip_all "there is no python3 to read JSON"

cat >"$scratch/plain.yaml" <<'YAML'
camera: {position: [0, 1, -4], look_at: [0, 0, 0], fov: 60}
lights: [{point: {position: [3, 5, -3]}}]
objects:
  - sphere: {center: [0, 0.5, 0], radius: 0.5, material: {reflection: 0.5}}
  - plane: {point: [0, 0, 0], normal: [0, 1, 0]}
YAML
# A light too strong for a float, and a triangle without area, which is warned of.
cat >"$scratch/strong.yaml" <<'YAML'
camera: {position: [0, 1, -4], look_at: [0, 0, 0], fov: 60}
lights: [{point: {position: [3, 5, -3], intensity: 1e30, color: [1e30, 1, 1]}}]
objects:
  - sphere: {center: [0, 0.5, 0], radius: 0.5}
  - triangle: {vertices: [[0, 0, 0], [1, 1, 1], [2, 2, 2]]}
YAML
echo 'objects: [{ball: {}}]' >"$scratch/broken.yaml"

# prints WANT NAME ARGUMENTS…: runs glint, whose JSON goes to $scratch/NAME.json, and expects the exit status WANT.
prints() {
    local want=$1 name=$2 got
    shift 2
    "$GLINT" "$@" >"$scratch/$name.json" 2>"$scratch/errors"
    got=$?
    if [ $got = "$want" ]; then pass; else fail "glint $*: exit status $got, expected $want: $(cat "$scratch/errors")"; fi
}
# members HEADING NAME…: the reports of these names have the members listed under the heading.
members() {
    local heading=$1
    shift
    check "members of $heading" python3 tests/json_members.py "$heading" "${@/#/$scratch/}"
}
small=(--size 48x32)
quick=(--lanes 1 --seconds 0.1)

prints 0 timing render "$scratch/plain.yaml" "${small[@]}" --lanes 1 --aov t,path --timing=json -o "$scratch/a.png"
members 'glint render --timing=json' timing.json

prints 0 valid check "$scratch/plain.yaml" --json
prints 0 warned check "$scratch/strong.yaml" --json
prints 1 broken check "$scratch/broken.yaml" --json
members 'glint check' {valid,warned,broken}.json

prints 0 devices devices --json
members 'glint devices' devices.json

"$GLINT" render "$scratch/plain.yaml" "${small[@]}" --lanes 1 --bounces 0 -o "$scratch/b.png" 2>"$scratch/errors"
prints 3 differing diff "$scratch/a.png" "$scratch/b.png" --heatmap "$scratch/map.png" --json
prints 0 equal diff "$scratch/a.t.npy" "$scratch/a.t.npy" --json
members 'glint diff' {differing,equal}.json

prints 0 bench bench "$scratch/plain.yaml" "$scratch/strong.yaml" "${small[@]}" "${quick[@]}" --bvh auto,on --launches --json
prints 0 again bench "$scratch/plain.yaml" "${small[@]}" "${quick[@]}" --bvh off,on --json --compare "$scratch/bench.json" \
    --tolerance 1e6
members 'glint bench' {bench,again}.json

# Cases with a measure and without, pictures among them.
prints 0 verify verify S5 P4 P6 --precision single --lanes 1 --lean --json
prints 0 perturbed verify P4 --precision single --lanes 1 --lean --json --perturb 1
members 'glint verify' {verify,perturbed}.json

if "$GLINT" verify C1 --precision double 2>&1 | grep -q 'has no 64-bit floating point'; then
    echo 'skipped: glint accuracy, as the device has no 64-bit floating point'
    finish
fi
# The planet's marbles sink in at single: objects and shadows are wrong, and the variant crossed out.
sed 's/2000002, 2999995/2000001.7, 2999995/' scenes/far-planet.yaml >"$scratch/planet.yaml"
prints 0 accuracy accuracy "$scratch/planet.yaml" scenes/mirror-glass.yaml "$scratch/strong.yaml" --size 96x64 "${quick[@]}" \
    --precision single,double --perturb 1 --save "$scratch/saved" --json
prints 0 paths accuracy tests/scenes/mirror-balls.yaml --size 96x64 "${quick[@]}" --bounces 16 --precision single,double --json
prints 0 itself accuracy "$scratch/plain.yaml" "${small[@]}" --seconds 0.1 --precision double --json
prints 0 file accuracy "$scratch/planet.yaml" --size 96x64 "${quick[@]}" --precision single --json \
    --reference "$scratch/saved/0-planet-reference.color.npy"
members 'glint accuracy' {accuracy,paths,itself,file}.json
finish
