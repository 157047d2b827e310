#!/bin/bash
# Runs tools/peers/still-life at a small size. Errors must fall with the samples, glint's image must be POV-Ray's, and an image
# of another scene must be reported. Needs POV-Ray, PyYAML and NumPy.
# run_tests: sanitize-long-only
. "$(dirname "$0")/support.bash"

command -v povray >/dev/null || skip_all "POV-Ray is not installed"
python_with yaml=PyYAML==6.0.3 numpy=numpy==2.4.6

still_life() { # GLINT
    "$python" tools/peers/still-life --glint "$1" --size 32x18 --counts 1,16 --reference-samples 128 --folder "$scratch/references" \
        --json "$scratch/still-life.json" --svg "$scratch/still-life.svg" --picture "$scratch/still-life.png"
}
check "the still life is measured, and glint's reference is POV-Ray's" still_life "$GLINT"

errors_fall() {
    "$python" - "$scratch" <<'PYTHON'
import json, pathlib, struct, sys
folder = pathlib.Path(sys.argv[1])
report = json.loads((folder / "still-life.json").read_text())
assert [(row["samples"], row["program"]) for row in report["rows"]] == [(1, "glint"), (1, "POV-Ray"), (16, "glint"), (16, "POV-Ray")]
for row in report["rows"]:
    assert 1e-5 < row["median"] < row["rmse"] < 0.2 and row["seconds"] > 0 and row["processor_seconds"] > 0, row
for program in "glint", "POV-Ray":
    assert -1.5 < report["slopes"][program]["rmse"] < -0.3, report["slopes"]
# Images without highlights, with shadows of glass, or with another lens, absorption or light are beyond these limits.
apart = report["models_apart"]
assert 1e-4 < apart["rmse"] < 0.006 and -0.0003 < apart["bias"] < 0.0002, apart
assert (folder / "still-life.svg").read_text().count("<polyline points=\"") == 9
assert struct.unpack(">II", (folder / "still-life.png").read_bytes()[16:24]) == (128, 72)
PYTHON
}
check "errors fall, and are plotted and drawn" errors_fall

cat >"$scratch/dull" <<SH
#!/bin/sh
exec "$GLINT" "\$@" --set materials.chrome.reflection=0
SH
chmod +x "$scratch/dull"
another_scene_is_reported() {
    rm "$scratch"/references/*-glint-*
    still_life "$scratch/dull"
    [ $? = 3 ]
}
check "a reference of another scene makes the run fail" another_scene_is_reported
finish
