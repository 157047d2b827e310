#!/bin/sh
# glint verify at every precision: its lines and its JSON say the same, and its exit status follows.
set -eu
cd "$(dirname "$0")/.."
GLINT=${GLINT:-build/glint}

"$GLINT" --version >/dev/null
if ! why=$("$GLINT" devices 2>&1); then
    echo "no OpenCL device: $why"
    exit 77
fi

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failed=0
fails() { echo "$*"; failed=1; }

status=0
"$GLINT" verify >"$scratch/lines" || status=$?
grep FAIL "$scratch/lines" && failed=1
[ $status = 0 ] || fails "glint verify: exit status $status"
for tier in A B C; do
    grep -q "^  tier $tier: 40 of 40 cases held" "$scratch/lines" || fails "tier $tier did not hold"
done

# At other widths, as JSON: the same bits.
for lanes in 1 8; do
    "$GLINT" verify S2 S5 P2 C6 C7 T1 R2 R6 --precision strict --lanes $lanes --json >"$scratch/$lanes.json" ||
        fails "verify --lanes $lanes: exit status $?"
    grep -q '"schema": *1' "$scratch/$lanes.json" || fails "the JSON has no schema"
    ! grep -q '"held": *false' "$scratch/$lanes.json" || fails "$(grep -B 3 '"held": *false' "$scratch/$lanes.json")"
    grep '"hash"' "$scratch/$lanes.json" >"$scratch/$lanes.hashes"
done
[ "$(wc -l <"$scratch/1.hashes")" = 8 ] || fails "not every case has a hash"
cmp -s "$scratch/1.hashes" "$scratch/8.hashes" || fails "strict: other bits at 8 lanes than at 1"

# A renderer that errs a thousand times as much as a device may is found out, whatever case one asks.
status=0
"$GLINT" verify P2 R3 --precision single --perturb 1:1000 >"$scratch/erring" || status=$?
[ $status = 3 ] || fails "a renderer that errs: exit status $status"
[ "$(grep -c 'FAIL.* wrong' "$scratch/erring")" = 2 ] || fails "a renderer that errs: $(cat "$scratch/erring")"

status=0
"$GLINT" verify S99 2>"$scratch/refused" || status=$?
[ $status = 1 ] && grep -q 'no case "S99"' "$scratch/refused" || fails "an unknown case: exit status $status"
exit $failed
