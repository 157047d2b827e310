#!/bin/bash
# The golden images come out bit for bit (tests/golden/README.md).
. "$(dirname "$0")/support.bash"
same() { cmp -s "$1" "$2" || { "$GLINT" diff "$1" "$2"; return 1; }; }
for scene in tests/golden/*.yaml; do
    name=$(basename "$scene" .yaml)
    check "$name renders" "$GLINT" render "$scene" --size 96x54 --precision strict --quiet -o "$scratch/$name.npy"
    check "$name: not the golden image" same "$scratch/$name.npy" "${scene%.yaml}.npy"
done
finish
