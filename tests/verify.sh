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

# At another width, as JSON.
"$GLINT" verify --precision single --lanes 1 --json >"$scratch/json" || fails "verify --lanes 1: exit status $?"
grep -q '"schema": *1' "$scratch/json" || fails "the JSON has no schema"
! grep -q '"held": *false' "$scratch/json" || fails "$(grep -B 3 '"held": *false' "$scratch/json")"
exit $failed
