#!/bin/bash
# glint diff on the command line: exit statuses, what it refuses, its JSON, the heat map.
. "$(dirname "$0")/support.bash"
cd "$scratch" || exit 1

# gray FILE VALUE [X]: an 8x4 PPM of one gray, and another value in the pixel X of the first row.
gray() {
    {
        printf 'P3\n8 4\n255\n'
        for i in {0..31}; do
            value=$2
            [ $# = 3 ] && [ "$i" = "$3" ] && value=0
            echo "$value $value $value"
        done
    } >"$1"
}
gray plain.ppm 128
gray same.ppm 128
gray spot.ppm 128 5
gray lighter.ppm 129
printf 'P3\n4 8\n255\n' >turned.ppm
for i in {0..31}; do echo 128 128 128; done >>turned.ppm

# status WANT WHAT ARGUMENTS…
status() {
    local want=$1 what=$2 got
    shift 2
    "$GLINT" diff "$@" >out 2>err
    got=$?
    if [ $got = "$want" ]; then pass; else fail "$what: exit status $got, expected $want: $(head -n 3 err)"; fi
}
says() {
    if grep -qF -- "$1" "$2"; then pass; else fail "nothing says '$1': $(head -n 5 "$2")"; fi
}

status 0 "the same file" plain.ppm plain.ppm
says "equal, bit for bit" out
status 0 "the same values" plain.ppm same.ppm
status 3 "one pixel" plain.ppm spot.ppm
says "3 of 96 values differ" out
says "worst      pixel 5,0: 0.501960814" out
status 3 "one step" plain.ppm lighter.ppm
says "96 values differ by 1, 0 by more, PSNR 48.13 dB" out
status 1 "another size" plain.ppm turned.ppm
says "differ in size: 8x4 with 3 channels, and 4x8 with 3" err
[ -s out ] && fail "something is printed of pictures that cannot be compared"
status 1 "a missing file" plain.ppm missing.png
status 1 "one picture" plain.ppm
status 1 "a scene" plain.ppm "$OLDPWD/scenes/demo.yaml"
status 1 "a heat map of no format" plain.ppm spot.ppm --heatmap map.jpg
status 1 "a heat map where there is no folder" plain.ppm spot.ppm --heatmap none/map.png

status 3 "a heat map" plain.ppm spot.ppm --heatmap map.ppm --json
says '"white": 0.2158605' out
if command -v python3 >/dev/null; then
    check "JSON" python3 - out <<'PYTHON'
import json, sys
told = json.load(open(sys.argv[1]))
assert told["schema"] == 1 and told["size"] == [8, 4] and told["equal"] is False, told
assert told["srgb8"] == {"psnr": told["srgb8"]["psnr"], "off_by_1": 0, "off_by_2_or_more": 3}, told
assert (told["worst"]["x"], told["worst"]["y"]) == (5, 0) and told["worst"]["picture"] == [0, 0, 0], told
assert told["flip"]["max"] > 0.05 and told["flip"]["pixels_per_degree"] == 67, told
PYTHON
fi
# White is at the pixel that differs, black where nothing does.
check "the heat map" cmp <(tail -c 96 map.ppm | od -An -v -tx1 -w3 | tr -d ' ') \
    <(for i in {0..31}; do if [ $i = 5 ]; then echo ffffff; else echo 000000; fi; done)
status 0 "a heat map of equal pictures" plain.ppm same.ppm --heatmap equal.png
check "its file" test -s equal.png
finish
