#!/bin/bash
# tools/peers/bench at a small size: the renderer on Embree draws what glint draws, and an image that is of other work
# is reported. Needs libembree-dev, and PyYAML.
. "$(dirname "$0")/support.bash"

is_sanitized && skip_all "Embree is not built with sanitizers"
[ -f /usr/include/embree3/rtcore.h ] || skip_all "there is no Embree (libembree-dev)"
python_with yaml=PyYAML==6.0.3
build=$(dirname "$GLINT")
${MAKE:-make} -s BUILD="$build" "$build/peers/embree" >"$scratch/make.log" 2>&1 || { cat "$scratch/make.log"; exit 1; }

bench() { # EMBREE RUNG…
    "$python" tools/peers/bench --glint "$GLINT" --scenes "$scratch/scenes" --rounds 1 --seconds 0.02 --size 240x136 \
        --precisions single --json "$scratch/bench.json" --only glint,Embree --embree "$@"
}
agree() { # ROW…
    "$python" - "$scratch/bench.json" "$@" <<'PYTHON'
import json, sys
rungs = json.load(open(sys.argv[1]))["rungs"]
for row in sys.argv[2:]:
    found = [rung["programs"][row] for rung in rungs if row in rung["programs"]]
    assert found, f"{row} was not run"
    for program in found:
        difference = program["difference"]
        assert program["frame_ms"]["median"] > 0 and difference["agrees"] and difference["mean"] < 0.05, (row, program)
PYTHON
}

# Another eye: line 2 of a description is the camera.
cat >"$scratch/moved" <<SH
#!/bin/sh
sed '2s/^[^ ]*/0.3/' "\$1" >"$scratch/moved.embree"
shift
exec "$build/peers/embree" "$scratch/moved.embree" "\$@"
SH
chmod +x "$scratch/moved"
other_work_is_reported() {
    bench "$scratch/moved" spheres-16
    [ $? = 3 ]
}

check "spheres and a mesh by Embree and glint are timed" bench "$build/peers/embree" spheres-16 bunny-2000
check "all of Embree's images are glint's" agree "Embree packets" "Embree packets, our spheres" "Embree single rays"
check "an image of other work makes the run fail" other_work_is_reported
finish
