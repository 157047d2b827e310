#!/bin/bash
# A device whose divisions, roots and powers are as wrong as the OpenCL C specification allows: the hard cases
# (docs/verify.md) meet tier A at `fast` and `single`, `strict` keeps its bits, at `double` only pow differs. One seed at
# single and the cases of rays, without the two large meshes, and R6; with GLINT_LONG_TESTS=1 seeds 1 to 20, fast, double
# and images.
# run_tests: sanitize-long-only
. "$(dirname "$0")/support.bash"
"$GLINT" devices >/dev/null 2>&1 || skip_all "no OpenCL device"

cases='S1 S3 S5 S6 P3 P4 P5 P7 C1 C2 C4 C5 C7 T2 T3 T6 M3 M4 M5 M6 R4'
seeds=1 precisions=single wide= bits_seed=1 bits_lanes=
if is_long; then
    bits_seed=7 bits_lanes='--lanes 4'
    cases+=' S2 S4 P1 P2 P6 C3 C6 T1 T4 T5 M1 M2 R1 R2 R3 R5 R8'
    seeds=$(seq 1 20) precisions='fast single'
    default_device=$("$GLINT" devices --json | tr -d '\n' | grep -o '"default": true[^}]*')
    [[ $default_device == *'"fp64": true'* ]] && wide=double
fi
is_sanitized && seeds=1

verify() { "$GLINT" verify $cases "$@" >"$scratch/lines" 2>&1; }
holds() { verify "$@" || { grep -E 'FAIL|error' "$scratch/lines"; return 1; }; }

# R7's colors and, at fast, R6 exceed their bounds under the permitted errors (docs/verify.md).
for seed in $seeds; do
    for precision in $precisions; do
        more=
        [ $precision = single ] && more=R6
        check "seed $seed at $precision" holds $more --precision $precision --perturb "$seed"
        grep -q "^  tier A: " "$scratch/lines" || fail "seed $seed at $precision is not judged by tier A"
    done
done

# Errors a thousand times as large exceed the bounds.
status=0
"$GLINT" verify S6 --precision single --perturb 1:1000 >"$scratch/lines" || status=$?
check "a thousand times the errors: exit status 3, here $status" test $status = 3
check "a thousand times the errors: rays hit the sphere they leave" grep -q '^  S6 .*FAIL' "$scratch/lines"

# `strict` repairs the device's errors, and no ray at `double` needs pow: same bits.
hashes() { "$GLINT" verify S1 S6 P4 C5 C7 T2 M4 R4 --json $bits_lanes "$@" | grep '"hash"'; }
for precision in strict $wide; do
    hashes --precision $precision >"$scratch/plain"
    check "$precision has 8 hashes" test "$(wc -l <"$scratch/plain")" = 8
    hashes --precision $precision --perturb $bits_seed >"$scratch/perturbed"
    check "$precision keeps its bits" diff "$scratch/plain" "$scratch/perturbed"
done
hashes --precision single >"$scratch/plain"
hashes --precision single --perturb $bits_seed >"$scratch/perturbed"
check 'single changes its bits' test "$(diff "$scratch/plain" "$scratch/perturbed" | grep -c '^>')" = 8

# Images differ between seeds, and are the same twice and at every width.
scene=tests/scenes/every_shape.yaml
render() { "$GLINT" render $scene --size 64x36 --quiet -o "$scratch/$1" "${@:2}"; }
if is_long; then
    render strict.npy --precision strict
    render strict_7.npy --precision strict --perturb 7
    check 'the image at strict keeps its bits' npy_same "$scratch/strict.npy" "$scratch/strict_7.npy" 64
fi
render single_7.npy --perturb 7
render single_8.npy --perturb 8
render single_7_again.npy --perturb 7 --lanes 1
check 'one seed, one image' npy_same "$scratch/single_7.npy" "$scratch/single_7_again.npy" 64
check 'another seed, another image' test "$(npy_same "$scratch/single_7.npy" "$scratch/single_8.npy" 64 | wc -l)" = 1
printf '0 1 -9 0 0.01 1\n-5 1 0 1 0 0.02\n1 9 -2 0.01 -1 0\n' >"$scratch/rays"
"$GLINT" trace $scene --rays "$scratch/rays" -o "$scratch/plain.csv"
"$GLINT" trace $scene --rays "$scratch/rays" -o "$scratch/perturbed.csv" --perturb 7
check 'traced rays differ' test "$(diff "$scratch/plain.csv" "$scratch/perturbed.csv" | wc -l)" -gt 0

# Only perturb.h calls what devices may do their own way; quotients of constants are the compiler's.
device_functions='sqrt|rsqrt|pow|powr|pown|exp|exp2|log|log2|native_[a-z0-9]*|half_[a-z]+|normalize|length|distance|sin|cos|tan'
device_functions+='|acos|atan2?|hypot|mad|mix|smoothstep|dot|cross|fmod'
strays=$(sed '/^enum/d; s,//.*,,; s/(real)([^()]*)//g' $(ls kernels/*.h kernels/*.cl kernels/*/*.h | grep -v -e /perturb.h -e /peak.cl) |
    grep -E "[^_a-z.]($device_functions)\(| / " || true)
check "only perturb.h calls inexact functions, but for: $strays" test -z "$strays"
finish
