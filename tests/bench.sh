#!/bin/bash
# glint bench on two tiny pictures: every field of its JSON, its counts, the comparison with an earlier report. Nothing
# is asked of the times themselves.
. "$(dirname "$0")/support.bash"

"$GLINT" devices >/dev/null 2>&1 || skip_all "no OpenCL device"
command -v python3 >/dev/null || skip_all "there is no python3 to read JSON"

scenes=(scenes/article.yaml scenes/triangles.yaml)
quick=(--size 32x24 --seconds 0.2)
"$GLINT" bench "${scenes[@]}" "${quick[@]}" --precision single,double --lanes 1 --launches --json \
    >"$scratch/report" 2>"$scratch/errors"
status=$?
[ $status = 0 ] || { fail "exit status $status: $(cat "$scratch/errors")"; finish; }
check "nothing on standard error" cmp "$scratch/errors" /dev/null

check "every field, and counts that agree with one another" python3 - "$scratch/report" "${scenes[@]}" <<'PYTHON'
import json, sys
report = json.load(open(sys.argv[1]))
scenes = sys.argv[2:]
number = (int, float)


def is_figure(value):
    """A number above 0, or why there is none."""
    if isinstance(value, dict):
        return value["status"] == "unavailable" and value["reason"]
    return isinstance(value, number) and value > 0


assert report["schema"] == 2
device = report["device"]
assert device["name"] and device["driver"] and device["type"] and device["units"] > 0
for key in "gflops_float", "gflops_double", "gigabytes_per_s":
    assert is_figure(device["peak"][key]), device
runs = [run for run in report["runs"] if "status" not in run]
for run in report["runs"]:
    assert run["bvh"] == "auto" and run["lanes"] == 1 and run["size"] == [32, 24], run
    assert "status" not in run or (run["precision"] == "double" and "64-bit" in run["reason"]), run
assert [(run["scene"], run["precision"]) for run in report["runs"]] == [
    (scene, precision) for scene in scenes for precision in ("single", "double")], report
assert len(runs) >= 2
for run in runs:
    for times in run["frame_ms"], run["kernel_ms"]:
        assert 0 < times["min"] <= times["median"] <= times["max"] and times["runs"] >= 1, run
    assert run["frame_ms"]["runs"] == run["kernel_ms"]["runs"], run
    assert run["clock"] == "event" or (run["clock"] == "host" and run["clock_doubt"]), run
    assert len(run["kernel_hash"]) == 16 and int(run["kernel_hash"], 16) > 0, run
    assert is_figure(run["build_ms"]["cold"]) and is_figure(run["build_ms"]["cached"]), run
    rays = run["rays"]
    assert set(rays) == {"camera", "camera_hits", "reflected", "refracted", "shadow"}, run
    assert rays["camera"] == 32 * 24 and 0 < rays["camera_hits"] <= rays["camera"] and rays["shadow"] > 0, run
    total = sum(rays.values()) - rays["camera_hits"]
    assert abs(run["mrays_per_s"] * run["kernel_ms"]["median"] * 1e3 / total - 1) < 1e-6, run
    assert is_figure(run["peak_fraction"]) and is_figure(run["bandwidth_fraction"]), run
    assert isinstance(run["peak_fraction"], dict) == run["hierarchy"], run
    assert run["launches"] and all(launch["name"] == "render" and launch["host_ms"] > 0 for launch in run["launches"])
hashes = {(run["scene"], run["precision"]): run["kernel_hash"] for run in runs}
assert len(set(hashes.values())) == len(hashes), "a kernel's hash tells it from others"
for scene in scenes:
    counts = [run["rays"]["camera_hits"] for run in runs if run["scene"] == scene]
    assert max(counts) - min(counts) <= 2, (scene, counts)
PYTHON

# compare WANT WHAT BASELINE ARGUMENTS…: the exit status of a run held against a baseline.
compare() {
    local want=$1 what=$2 baseline=$3 got
    shift 3
    "$GLINT" bench scenes/article.yaml "${quick[@]}" --lanes 1 --compare "$baseline" "$@" \
        >"$scratch/out" 2>"$scratch/errors"
    got=$?
    if [ $got = "$want" ]; then pass; else fail "$what: exit status $got, expected $want: $(cat "$scratch/errors")"; fi
}

# doctor FACTOR FILE: the report with its times multiplied.
doctor() {
    python3 - "$scratch/report" "$1" >"$2" <<'PYTHON'
import json, sys
report = json.load(open(sys.argv[1]))
for run in report["runs"]:
    for times in ("frame_ms", "kernel_ms") if "status" not in run else ():
        for key in "min", "median", "max":
            run[times][key] *= float(sys.argv[2])
json.dump(report, sys.stdout)
PYTHON
}

compare 0 "against itself" "$scratch/report" --tolerance 1000000
check "the ratio is told" grep -q 'ratio to baseline: frame [0-9.]*, kernel [0-9.]*$' "$scratch/out"
# a machine that is busy may take many times as long, but not a millionth
doctor 0.000001 "$scratch/faster"
compare 3 "against a faster one" "$scratch/faster" --tolerance 10 --json
check "the ratio in JSON" python3 -c '
import json, sys
ratio = json.load(open(sys.argv[1]))["runs"][0]["ratio"]
assert ratio["slower"] is True and ratio["frame"] > 10 and ratio["kernel"] > 10, ratio' "$scratch/out"
compare 1 "without a row in common" "$scratch/report" --size 16x16
compare 1 "against what is no report" README.md
compare 1 "against what is not there" "$scratch/none"

usage() {
    "$GLINT" bench "$@" >"$scratch/out" 2>&1
    local got=$?
    if [ $got = 1 ] && [ -s "$scratch/out" ]; then pass; else fail "glint bench $*: exit status $got"; fi
}
usage
usage scenes/none.yaml
usage scenes/article.yaml --precision half
usage scenes/article.yaml --lanes 2
usage scenes/article.yaml --seconds 0
usage scenes/article.yaml --tolerance -1
finish
