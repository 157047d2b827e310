#!/bin/bash
# Event times are used where they can be true, and not where a runtime reports zeros or counts (rusticl, Mesa 22.3): there
# the host's clock stands in, and a word says so.
. "$(dirname "$0")/support.bash"
cd "$scratch" || exit 1
cat >plane.yaml <<'E2'
camera: {position: [0, 1, -4], look_at: [0, 0, 0], fov: 60}
ambient: [1, 1, 1]
objects: [{plane: {point: [0, 0, 0], normal: [0, 1, 0]}}]
E2

# timings ICD: JSON of a render in out, text in err.
timings() {
    OCL_ICD_VENDORS=$1 "$GLINT" render plane.yaml --size 320x180 --quiet --timing=json -o a.png >out 2>/dev/null &&
        OCL_ICD_VENDORS=$1 "$GLINT" render plane.yaml --size 320x180 --quiet --timing -o a.png 2>err
}
says() { check "$1" python3 -c "import json; launches = json.load(open('out'))['launches']; assert launches; $2"; }

pocl=$(find /etc/OpenCL/vendors -name '*pocl*.icd' 2>/dev/null | head -1)
if [ "$pocl" ]; then
    check 'PoCL renders' timings "$pocl"
    says "PoCL's events are trusted" 'assert all(0 < l["event_ms"] <= 1.01 * l["host_ms"] + .001 and "doubt" not in l
    for l in launches), launches'
    check 'no word of distrust' test "$(grep -c 'render .*not trusted' err)" = 0
else
    echo 'skipped: PoCL is not here'
fi

export RUSTICL_ENABLE=llvmpipe
rusticl=$(find /etc/OpenCL/vendors -name '*rusticl*.icd' 2>/dev/null | head -1)
if ! is_sanitized && [ "$rusticl" ] && OCL_ICD_VENDORS=$rusticl "$GLINT" devices | grep -q '^0.*llvmpipe'; then
    check 'rusticl renders' timings "$rusticl"
    # Mesa releases that report times are believed; a time of nothing, for 57600 pixels, is not.
    says "no event of rusticl is taken for a time of next to nothing" \
        'assert all(l["host_ms"] > 0 and (l["event_ms"] is None and l["doubt"] or l["event_ms"] > 0.001) for l in launches)'
    if grep -q '"event_ms": null' out; then
        check 'the host is used, and it says so' grep -q "the host's are used" err
        launches=$(sed -n 's/^ *launches *\([0-9.]*\) ms.*/\1/p' err)
        check "the sum of the launches is not 0 but $launches ms" awk "BEGIN { exit !($launches > 0) }"
    fi
else
    echo 'skipped: rusticl with llvmpipe is not here, or the build is sanitized'
fi
[ $passed -gt 0 ] || skip_all 'neither PoCL nor rusticl is here'
finish
