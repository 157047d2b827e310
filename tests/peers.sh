#!/bin/bash
# Checks that tools/peers/bench at a small size reports an image of other work. The renderer on Embree must draw what glint
# draws, and so must Tachyon and POV-Ray for an NFF file, where they are installed. Needs libembree-dev and PyYAML.
. "$(dirname "$0")/support.bash"

is_long || skip_all "only with GLINT_LONG_TESTS=1"
is_sanitized && skip_all "Embree is not built with sanitizers"
[ -f /usr/include/embree3/rtcore.h ] || skip_all "there is no Embree (libembree-dev)"
python_with yaml=PyYAML==6.0.3
$make -s BUILD="$build" "$build/peers/embree" >"$scratch/make.log" 2>&1 || { cat "$scratch/make.log"; exit 1; }

bench() { # EMBREE RUNG…
    "$python" tools/peers/bench --glint "$GLINT" --scenes "$scratch/scenes" --rounds 1 --seconds 0.02 --size 240x136 \
        --precisions single --json "$scratch/bench.json" --only glint,Embree --embree "$@"
}
# Coarse smooth meshes have larger limits, because only glint starts shadow rays on the curve of the triangles. The mean
# differences of these two are 0.18 and 0.048 of 255.
agree_within() { # MEAN ROW…
    "$python" - "$scratch/bench.json" "$@" <<'PYTHON'
import json, sys
rungs, mean = json.load(open(sys.argv[1]))["rungs"], float(sys.argv[2])
means = {"bunny-2000": 0.2, "sun-2000x4": 0.06}
for row in sys.argv[3:]:
    found = {rung["scene"]: rung["programs"][row] for rung in rungs if row in rung["programs"]}
    assert found, f"{row} was not run"
    for scene, program in found.items():
        difference = program["difference"]
        assert program["peak_bytes"] > 1e6, (row, program)
        assert program["frame_ms"]["median"] > 0 and difference["agrees"], (row, program)
        assert difference["mean"] < means.get(scene, mean), (scene, row, program)
PYTHON
}

# Moves the eye. A description begins with the number of cameras, in 8 bytes, and the eye's x as a float, which becomes 0.3.
cat >"$scratch/moved" <<SH
#!/bin/sh
{ head -c 8 "\$1"; printf '\232\231\231\76'; tail -c +13 "\$1"; } >"$scratch/moved.embree"
shift
exec "$build/peers/embree" "$scratch/moved.embree" "\$@"
SH
chmod +x "$scratch/moved"
other_work_is_reported() {
    bench "$scratch/moved" spheres-16
    [ $? = 3 ]
}

rungs=(spheres-16 bunny-2000 sun-2000x4 soup-500 forest-50)
check "spheres, meshes, instances, a directional light and samples are timed" bench "$build/peers/embree" "${rungs[@]}"
check "all of Embree's images are glint's" agree_within 0.05 "Embree packets" "Embree packets, our spheres" "Embree single rays"
stretched_instances_are_refused() {
    sed 's/{scale: [0-9.]*}/{scale: [1, 2, 1]}/' "$scratch/scenes/forest-50.yaml" >"$scratch/scenes/stretched.yaml"
    message=$("$python" -B -c 'import sys; sys.path.insert(0, "tools/peers"); import scene; scene.read_scene(sys.argv[1])' \
        "$scratch/scenes/stretched.yaml" 2>&1)
    [[ $message == *"only instances with one positive scale"* ]]
}
check "instances that are stretched are refused" stretched_instances_are_refused
check "an image of other work makes the run fail" other_work_is_reported

growth_has_rows_and_lines() {
    "$python" tools/peers/growth --glint "$GLINT" --embree "$build/peers/embree" --scenes "$scratch/scenes" --rounds 1 \
        --seconds 0.02 --size 96x54 --counts 100,1000 --embree-most 100 --json "$scratch/growth.json" \
        --svg "$scratch/growth.svg" &&
        [ "$(grep -c '"frame_ms"' "$scratch/growth.json")" = 6 ] && grep -q '"count": 1000,' "$scratch/growth.json" &&
        [ "$(grep -c '<polyline points="[0-9]' "$scratch/growth.svg")" = 8 ]
}
check "growth is measured and plotted" growth_has_rows_and_lines

# Mirrors, a cylinder, a concave polygon and a smooth one.
cat >"$scratch/mirrors.nff" <<'NFF'
v
from 0 -6 3
at 0 0 0.6
up 0 0 1
angle 40
hither 1
resolution 240 136
b 0.12 0.31 0.72
l 4 -5 6
l -5 -2 4 0.5 0.4 0.3
f 0.9 0.7 0.4 0.8 0.3 20 0 0
p 5
-3 -3 0
3 -3 0
3 3 0
0 0 0
-3 3 0
f 0.3 0.8 0.5 0.6 0.4 30 0 0
s 0 -0.5 0.7 0.6
c -1.5 0 0 0.4 -1.5 0 1.4 0.4
pp 3
1 0 0 0.28 -0.96 0
2 0.5 0 0.6 -0.8 0
1.5 0.3 1.5 0.48 -0.8 0.36
NFF
sed 's/0\.3 20 0 0/0 20 0 0/; s/0\.4 30 0 0/0 30 0 0/; /^c/d' "$scratch/mirrors.nff" >"$scratch/dull.nff"
bench_nff() {
    "$python" tools/peers/bench --glint "$GLINT" --embree "$build/peers/embree" --scenes "$scratch/scenes" --rounds 1 \
        --seconds 0.02 --size 240x136 --precisions single,double --json "$scratch/bench.json" "$@"
}

nff=("$scratch/dull.nff" "$scratch/mirrors.nff")
check "NFF files are drawn by the programs that are installed" bench_nff "${nff[@]}"
check "Embree's images of polygons are glint's" agree_within 0.05 "Embree packets" "Embree single rays"
[ -z "$(command -v tachyon)" ] || check "Tachyon's images of mirrors are glint's" agree_within 0.6 Tachyon
[ -z "$(command -v povray)" ] || check "POV-Ray's images of mirrors are glint's" agree_within 0.05 POV-Ray
finish
