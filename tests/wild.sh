#!/bin/bash
# Scenes in the manner of those that people keep, tests/wild/*.rt and *.cfg: each renders or is refused as the file
# SCENE.expected says. Its first line is one of
#     refused          exit status 1, and no picture
#     renders          a picture of more than one color
#     renders blank    a picture of one color
#     renders as NAME  the picture of the scene NAME, bit for bit
# with --lenient at the end where that option is meant. The other lines are all that is said, in order:
# LINE:COLUMN: error or warning: …
. "$(dirname "$0")/support.bash"

"$GLINT" devices >/dev/null 2>&1 || skip_all "no OpenCL device"

# render SCENE PICTURE [OPTION…]
render() {
    local scene=$1 picture=$2
    shift 2
    "$GLINT" render "$scene" -o "$picture" --size 64x48 --quiet "$@"
}

# Behind the 13 bytes of its header a PPM of this size is three bytes a pixel.
count_colors() { tail -c +14 "$1" | od -An -v -tx1 -w3 | sort -u | wc -l; }

# said FILE NAME: the messages alone, without the lines they show and the scene's name.
said() {
    sed -nE -e '/(^|: )(error|warning): /!d' -e "s|^glint: (error\|warning): [^ ]*$2: |\1: |" -e "s|^[^ ]*$2:||" -e p "$1"
}

for scene in tests/wild/*.rt tests/wild/*.cfg; do
    name=$(basename "$scene") picture=$scratch/$(basename "$scene").ppm
    read -r outcome what _ <"$scene.expected" || { fail "$scene: no $name.expected"; continue; }
    options=()
    if grep -q '^[a-z ]*--lenient$' "$scene.expected"; then options=(--lenient); fi

    render "$scene" "$picture" "${options[@]}" >"$scratch/out" 2>"$scratch/errors"
    status=$?
    check "$name: nothing on standard output" cmp "$scratch/out" /dev/null
    check "$name: what is said" diff <(tail -n +2 "$scene.expected") <(said "$scratch/errors" "$name")
    if [ "$outcome" = refused ]; then
        check "$name: exit status $status, expected 1" [ $status = 1 ]
        check "$name: a picture all the same" [ ! -e "$picture" ]
        continue
    fi
    check "$name: exit status $status, expected 0" [ $status = 0 ]
    case $what in
    as)
        twin=$(sed -n '1s/.* as \([^ ]*\).*/\1/p' "$scene.expected")
        check "$name: not the picture of $twin" \
            eval 'render "tests/wild/$twin" "$scratch/twin.ppm" && cmp "$picture" "$scratch/twin.ppm"'
        ;;
    blank) check "$name: not blank" [ "$(count_colors "$picture")" = 1 ] ;;
    *) check "$name: blank" [ "$(count_colors "$picture")" -gt 1 ] ;;
    esac
done

# As many objects as the largest file seen.
awk 'BEGIN {
    print "A 0.2 255,255,255\nC 0,60,-60 0,-0.6,0.8 70\nL -50,90,-50 0.8 255,255,255"
    for (i = 0; i < 11000; i++)
        printf i % 2 ? "sp %g,%g,%g 0.9 %d,%d,90\n" : "cy %g,%g,%g 0,1,0 0.7 2 %d,%d,160\n",
            i % 110 - 55, i % 7 / 4, i / 110 - 50, i % 256, i / 43 % 256
}' >"$scratch/large.rt"
check "11,000 objects" render "$scratch/large.rt" "$scratch/large.ppm"
check "11,000 objects: few colors" [ "$(count_colors "$scratch/large.ppm")" -gt 500 ]

finish
