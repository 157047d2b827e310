#!/bin/bash
# The golden images come out bit for bit (tests/golden/README.md).
. "$(dirname "$0")/support.bash"
for scene in tests/golden/*.yaml; do
    name=$(basename "$scene" .yaml)
    check "$name renders" "$GLINT" render "$scene" --size 96x54 --precision strict --quiet -o "$scratch/$name.npy"
    check "$name: not the golden image" npy_same "$scratch/$name.npy" "${scene%.yaml}.npy" 96
done
finish
