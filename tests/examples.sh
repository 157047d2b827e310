#!/bin/bash
# Checks that commands print what the documents show, exactly if nothing is timed, else line for line with other numbers, hashes
# and device names. GLINT_LONG_TESTS=1 also runs commands that measure.
. "$(dirname "$0")/support.bash"

# example DOCUMENT COMMAND: prints the lines below "$ COMMAND" in the document, without their indentation.
example() {
    awk -v command="    \$ $2" '
        $0 == command { within = 1; next }
        within && !/^    / && !/^$/ { exit }
        /^    \$ / { if (within) exit }
        within { sub(/^    /, ""); lines[++count] = $0 }
        END { while (count && lines[count] == "") count--; for (i = 1; i <= count; i++) print lines[i] }' "$1"
}
# Makes numbers, hashes, devices and columns alike.
shape() {
    sed -E 's/\(kernel [0-9a-f]+\)/(kernel H)/; s/\b[0-9a-f]{16}\b/H/g; s/[-+]?[0-9.]+(e[-+]?[0-9]+)?|inf/N/g; s/ on .* \(/ on D (/; s/ +/ /g; s/ $//' |
        grep -v -e 'Portable Computing Language' -e '^ for an error of' -e 'fastest rows' -e ' crossed out:' | sort -u
}
exact() {
    check "$1: $2" test -n "$(example "$1" "$2")"
    check "$1: what $2 prints" diff <(example "$1" "$2") <(cd "$scratch" && sh -c "PATH=$scratch:\$PATH; $2" 2>&1)
}
alike() {
    check "$1: $2" test -n "$(example "$1" "$2")"
    check "$1: lines of $2" diff <(example "$1" "$2" | shape) <(cd "$scratch" && sh -c "PATH=$scratch:\$PATH; $2 $3" 2>&1 | shape)
}

guide=docs/guide.md
ln -s "$GLINT" "$scratch/glint"
ln -s "$PWD/scenes" "$scratch/scenes"
example $guide 'cat rays.txt' >"$scratch/rays.txt"
sed -n '/^```yaml$/,/^```$/p' $guide | sed '/^```/d' >"$scratch/first.yaml"

check "$guide: its scene renders" "$GLINT" render "$scratch/first.yaml" --size 96x54 --quiet -o "$scratch/first.png"

cookbook=docs/cookbook.md
tools/cookbook "$scratch/cookbook"
sed -i 's/model\.glb/scenes\/meshes\/bunny.obj/' "$scratch/cookbook/model.yaml" # a user's model
scenes=$(ls "$scratch/cookbook"/*.yaml)
check "$cookbook: each heading and the stage have a scene" test "$(echo "$scenes" | wc -l)" -eq "$(grep -c '^## \|^# stage' $cookbook)"
for scene in $scenes; do
    name=$(basename "$scene")
    check "$cookbook: $name is read without a message" diff /dev/null <("$GLINT" check "$scene" 2>&1 >"$scratch/counts")
    check "$cookbook: $name has objects" grep -q '^  objects  *[1-9]' "$scratch/counts"
    # each needs kernels that no other test has
    ! is_long || is_sanitized || check "$cookbook: $name renders" "$GLINT" render "$scene" --size 32x18 --quiet -o "$scene.png"
done
check "$cookbook: its last frames render" "$GLINT" render "$scratch/cookbook/turntable.yaml" --frames 46-47 --size 32x18 --quiet \
    -o "$scratch/cookbook/frame-%02d.png"
check "$cookbook: frame 47 is written" test -s "$scratch/cookbook/frame-47.png"

exact $guide 'glint trace scenes/article.yaml --rays rays.txt'
# it builds many kernels
! is_long || is_sanitized || alike $guide 'glint accuracy scenes/mirror-glass.yaml --size 320x180 --precision single,double' '--seconds 0.01'
finish
