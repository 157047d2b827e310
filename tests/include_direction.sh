#!/bin/sh
# Checks that includes run one way: main and mpi, cli, {measure, verify, view}, api, render, compile, {import, then scene, then
# image; opencl}, base. A room includes itself and the rooms below it. Only compile, render and opencl include the kernels'
# shared headers, each its set, only opencl and render include OpenCL's, only view those of the window, and only mpi MPI's.
# Checks also that the rooms that make a scene's flat arrays call none of libm's functions that differ between processors.
set -eu
cd "$(dirname "$0")/.."

# Prints each forbidden include below the folder, as file:line: and what is wrong.
forbidden_includes() {
    (cd "$1" && find host kernels -name '*.[ch]' -o -name '*.cl' | sort | xargs grep -nHE '^[ \t]*#[ \t]*include') |
        awk -F: '
            BEGIN { level["base"] = 0; level["image"] = 1; level["scene"] = level["opencl"] = 2; level["import"] = 3
                    level["compile"] = 4; level["render"] = 5; level["api"] = 6
                    level["measure"] = level["verify"] = level["view"] = 7
                    level["cli"] = 8; level["mpi"] = level["main.c"] = 9
                    shared["compile kernels/types.h"] = shared["compile kernels/features.h"] = 1
                    shared["render kernels/aovs.h"] = shared["opencl kernels/probes.h"] = 1
                    split("shapes traversal shading numerics", folders, " ")
                    for (i in folders) kernel_folder[folders[i]] = 1 }
            function wrong(what) { print $1 ":" $2 ": " what }
            {
                split($1, source, "/"); split($3, quoted, "[<>\"]"); file = quoted[2]; split(file, target, "/")
                room = source[2]
                if (source[1] == "kernels") {
                    if (file ~ /\// && !(target[1] in kernel_folder))
                        wrong("a kernel includes " file ", which is not a kernel file")
                } else if (!(room in level)) wrong("no room is called " room)
                else if ($3 ~ /</) {
                    if (target[1] == "CL" && room != "opencl" && room != "render") wrong(room " includes OpenCL")
                    if (file == "mpi.h" && room != "mpi") wrong(room " includes MPI")
                    if (file ~ /^(SDL|fontconfig)/ && room != "view") wrong(room " includes the window\047s libraries")
                } else if (target[1] == "kernels") {
                    if (!((room " " file) in shared)) wrong(room " includes " file)
                } else if (target[1] != "host" || !(target[2] in level)) wrong(file " is in no room")
                else if (room != target[2] && level[target[2]] >= level[room]) wrong(room " includes " target[2])
            }'
}

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failed=0

# Tests the check itself. A tree with one include must be as allowed as the first argument states.
expect() {
    rm -rf "$scratch/tree"
    mkdir -p "$scratch/tree/kernels" "$scratch/tree/host" "$scratch/tree/$(dirname "$2")"
    echo "$3" >"$scratch/tree/$2"
    found=$(forbidden_includes "$scratch/tree")
    case $1:$found in
    allowed: | forbidden:?*) ;;
    *)
        echo "$2 with $3 should be $1; found: $found"
        failed=1
        ;;
    esac
}

expect allowed host/main.c '#include "host/cli/commands.h"'
expect allowed host/cli/render.c '#include "host/render/renderer.h"'
expect allowed host/measure/bench.c '#include "host/render/renderer.h"'
expect allowed host/verify/verify.c '#include "host/render/renderer.h"'
expect allowed host/render/renderer.c '#include "host/compile/compile.h"'
expect allowed host/render/renderer.c '#include "host/base/text.h"'
expect allowed host/import/load.c '#include "host/scene/scene.h"'
expect allowed host/compile/features.h '#include "kernels/features.h"'
expect allowed host/render/film.h '#include "kernels/aovs.h"'
expect allowed host/opencl/passport_measure.c '#include "kernels/probes.h"'
expect allowed host/render/launch.c '#include <CL/cl.h>'
expect allowed host/scene/scene.c '#include <stdio.h>'
expect allowed host/view/window.c '#include <SDL.h>'
expect allowed kernels/render.cl '#include "numerics/lanes.h"'
expect forbidden host/cli/render.c '#include "host/main.c"'
expect forbidden host/measure/report.c '  #  include "host/cli/commands.h"'
expect forbidden host/measure/report.c '#include "host/verify/verify.h"'
expect forbidden host/render/renderer.c '#include "host/measure/report.h"'
expect forbidden host/compile/flatten.c '#include "host/render/renderer.h"'
expect forbidden host/scene/scene.c '#include "host/import/load.h"'
expect forbidden host/scene/scene.c '#include "host/opencl/device.h"'
expect forbidden host/opencl/device.c '#include "host/scene/scene.h"'
expect forbidden host/image/png.c '#include "host/scene/scene.h"'
expect forbidden host/base/text.c '#include "host/scene/scene.h"'
expect forbidden host/base/text.c '#include "text.h"'
expect forbidden host/compile/flatten.c '#include <CL/cl.h>'
expect forbidden host/measure/report.c '#include <CL/cl.h>'
expect forbidden host/render/renderer.c '#include "kernels/types.h"'
expect forbidden host/measure/report.c '#include "kernels/aovs.h"'
expect forbidden host/cli/view.c '#include <SDL_ttf.h>'
expect forbidden host/compile/flatten.c '#include "kernels/shapes/sphere.h"'
expect allowed host/api/image.c '#include "host/render/renderer.h"'
expect forbidden host/render/renderer.c '#include "host/api/glint.h"'
expect forbidden host/extra/thing.c '#include "host/base/text.h"'
expect forbidden kernels/types.h '#include "host/base/text.h"'

# Prints each call of a function in place of which host/scene/portable.h has one.
unportable_calls() {
    sed 's|//.*||' "$1" | grep -nE '(^|[^_[:alnum:]])(a?(sin|cos|tan)h?|atan2|exp2?|expm1|log(2|10|1p)?|pow|cbrt|hypot)[fl]?\(' | sed "s|^|$1:|"
}

printf '%s\n' 'a = sin(b); // pow(c, d)' 'a = powf(b, c);' 'a = log1pl(b);' 'a = acosh(b);' >"$scratch/calls.c"
echo 'a = portable_sine(b); // pow(c, d)' >"$scratch/none.c"
if [ "$(unportable_calls "$scratch/calls.c" | wc -l)" != 4 ] || [ -n "$(unportable_calls "$scratch/none.c")" ]; then
    echo "unportable_calls misses a call or finds one where there is none"
    failed=1
fi

found=$(
    forbidden_includes .
    find host/scene host/import host/compile -name '*.[ch]' | while read -r file; do unportable_calls "$file"; done
)
if [ -n "$found" ]; then
    echo "$found"
    failed=1
fi
exit $failed
