#!/bin/sh
# Every scene in scenes/ is read without a warning and renders to a PNG; the same image as PPM shows that it is not
# blank.
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

for scene in scenes/*.*; do
    if ! said=$("$GLINT" check "$scene" 2>&1 >/dev/null) || [ "$said" ]; then
        fails "$scene: glint check says: $said"
        continue
    fi
    for kind in png ppm; do
        "$GLINT" render "$scene" -o "$scratch/image.$kind" --size 64x36 --precision single --quiet ||
            fails "$scene: no image.$kind"
    done
    [ "$(head -c 4 "$scratch/image.png" | tail -c 3)" = PNG ] || fails "$scene: what was written is no PNG"
    # Behind the 13 bytes of its header a PPM is three bytes a pixel.
    color_count=$(tail -c +14 "$scratch/image.ppm" | od -An -v -tx1 -w3 | sort -u | wc -l)
    [ "$color_count" -ge 16 ] || fails "$scene: $color_count colors in all"
    rm -f "$scratch"/image.*
done
set -- scenes/*.*
[ $# -ge 12 ] || fails "$# scenes, fewer than 12"
exit $failed
