#!/bin/bash
# glint verify: all cases pass at single and a few at the other precisions, with GLINT_LONG_TESTS=1 all at each; its exit
# status follows, and its JSON says what was run. The sanitized build, many times as slow, runs the host's side of a few
# cases at one precision.
. "$(dirname "$0")/support.bash"

why=$("$GLINT" devices 2>&1) || skip_all "no OpenCL device: $why"
wide=D
"$GLINT" verify C1 --precision double 2>&1 | grep -q 'has no 64-bit floating point' && wide=

# A failed case's line is shown.
holds() { "$GLINT" verify "$@" >"$scratch/lines" 2>"$scratch/errors" || { grep FAIL "$scratch/lines" "$scratch/errors"; return 1; }; }
if is_sanitized; then
    check 'cases at single' holds S1 P7 C7 M3 R1 R3 R4 R8 --precision single
    check 'tier B holds' grep -q '^  tier B: 8 of 8 cases passed' "$scratch/lines"
elif is_long; then
    check 'glint verify' holds
    for tier in A B C $wide; do
        check "tier $tier holds" grep -q "^  tier $tier: 43 of 43 cases passed" "$scratch/lines"
    done
else
    check 'all cases at single' holds --precision single
    check 'tier B holds' grep -q '^  tier B: 43 of 43 cases passed' "$scratch/lines"
    for precision in fast strict ${wide:+double}; do
        check "some cases at $precision" holds S1 P7 C7 T3 M3 R1 --precision $precision
    done
fi

# At other widths, as JSON: the same bits.
cases='S2 S5 P2 C6 C7 T1 R2 R6' precision=strict
is_sanitized && cases='S5 C7' precision=single
for lanes in 1 8; do
    report=$scratch/$lanes.json
    check "verify --lanes $lanes" "$GLINT" verify $cases --precision $precision --lanes $lanes --json
    mv "$scratch/check.log" "$report"
    for member in '"schema": 3' '"reference_bits": ' '"glint": "' '"platform_version": "' "\"lanes\": $lanes,"; do
        check "the JSON has $member" grep -qF "$member" "$report"
    done
    check 'not perturbed, it does not speak of it' test "$(grep -c '"perturb"' "$report")" = 0
    check 'no case failed' test "$(grep -c '"passed": *false' "$report")" = 0
    grep '"hash"' "$report" >"$scratch/$lanes.hashes"
    check 'every case has a hash' test "$(wc -l <"$scratch/$lanes.hashes")" = "$(wc -w <<<"$cases")"
done
check "$precision: the same bits at 8 lanes as at 1" cmp "$scratch/1.hashes" "$scratch/8.hashes"

# So do kernels of what each scene needs alone.
hashes() { "$GLINT" verify S5 C7 --precision $precision --json "$@" | grep '"hash"'; }
check "$precision: the same bits when lean" diff <(hashes) <(hashes --lean)
check 'there are bits to compare' test "$(hashes --lean | wc -l)" = 2

# A renderer that errs a thousand times as much as a device may is found out. (Not by every case: a plane asks for few
# quotients and no roots, and P2 holds even then.)
status=0
"$GLINT" verify R1 R3 --precision single --perturb 1:1000 >"$scratch/erring" || status=$?
check "a renderer that errs: exit status $status, not 3" test $status = 3
check 'a renderer that errs: both cases are wrong' test "$(grep -c 'FAIL.* wrong' "$scratch/erring")" = 2
check 'the JSON names the injected errors' \
    grep -Pzq '"perturb": \{\s*"seed": 1,\s*"scale": 1000\s*\}' <("$GLINT" verify P4 --precision single --perturb 1:1000 --json)

status=0
"$GLINT" verify S99 2>"$scratch/refused" || status=$?
check "an unknown case: exit status $status, not 1" test $status = 1
check 'an unknown case is named' grep -q 'no case "S99"' "$scratch/refused"
finish
