#compdef glint
# Completion of glint for zsh; the options of each subcommand are checked against its --help by tests/man_options.sh.

_glint_render() {
    _arguments \
        '(-o --output)'{-o,--output}'[where the picture goes]:picture:_files -g "*.(png|ppm|exr|npy)"' \
        '--size[width and height in pixels]:WxH:' \
        '--samples[rays for each pixel]:number:' \
        '--region[pixels of the whole picture to render]:X,Y,W,H:' \
        '--device[device to render on]:device:(cpu gpu)' \
        '--precision[how exactly to compute]:precision:(fast single strict double)' \
        '--lanes[pixels a work-item carries at once]:lanes:(1 4 8 16)' \
        '--bvh[use a BVH]:choice:(auto on off)' \
        '--bounces[reflections and refractions at most]:number:' \
        '--aov[other things than the picture]:kinds:_sequence compadd - t normal position object shadow ray path color' \
        '--timing=-[how long each stage took]::form:(json)' \
        '--transfer[curve from linear light to display values]:curve:(srgb none)' \
        '--bits[bits a channel]:bits:(8 16)' \
        '--no-cache[build the kernel anew]' \
        '--perturb[err as other devices may]:SEED[\:SCALE]:' \
        '--lenient[skip unknown elements of a .rt scene]' \
        '--quiet[no progress]' \
        '(- *)'{-h,--help}'[list the options]' \
        '1:scene:_files -g "*.(yaml|yml|rt|cfg|nff)"'
}

_glint_trace() {
    _arguments \
        '--rays[file of rays]:rays:_files' \
        '(-o --output)'{-o,--output}'[where the CSV goes]:file:_files' \
        '--device[device to trace on]:device:(cpu gpu)' \
        '--precision[how exactly to compute]:precision:(fast single strict double)' \
        '--lanes[rays a work-item carries at once]:lanes:(1 4 8 16)' \
        '--bvh[use a BVH]:choice:(auto on off)' \
        '--no-cache[build the kernel anew]' \
        '--perturb[err as other devices may]:SEED[\:SCALE]:' \
        '--lenient[skip unknown elements of a .rt scene]' \
        '(- *)'{-h,--help}'[list the options]' \
        '1:scene:_files -g "*.(yaml|yml|rt|cfg|nff)"'
}

_glint_check() {
    _arguments \
        '--json[print JSON]' \
        '--lenient[skip unknown elements of a .rt scene]' \
        '(- *)'{-h,--help}'[list the options]' \
        '1:scene:_files -g "*.(yaml|yml|rt|cfg|nff)"'
}

_glint_devices() {
    _arguments \
        '--json[print JSON]' \
        '(- *)'{-h,--help}'[list the options]'
}

_glint_verify() {
    _arguments \
        '--device[device to verify]:device:(cpu gpu)' \
        '--precision[how exactly to compute]:precision:(fast single strict double)' \
        '--lanes[rays a work-item carries at once]:lanes:(1 4 8 16)' \
        '--no-cache[build the kernels anew]' \
        '--perturb[err as other devices may]:SEED[\:SCALE]:' \
        '--lean[build small kernels, for a slow compiler]' \
        '--json[print JSON]' \
        '(- *)'{-h,--help}'[list the options]'
}

_glint_diff() {
    _arguments \
        '--heatmap[picture of the differences]:picture:_files -g "*.(png|ppm|exr|npy)"' \
        '--json[print JSON]' \
        '(- *)'{-h,--help}'[list the options]' \
        '1:reference:_files -g "*.(png|ppm|exr|npy)"' \
        '2:picture:_files -g "*.(png|ppm|exr|npy)"'
}

_glint_bench() {
    _arguments \
        '--precision[how exactly to compute]:list:_sequence compadd - fast single strict double' \
        '--lanes[pixels a work-item carries at once]:list:_sequence compadd - 1 4 8 16' \
        '--bvh[use a BVH]:list:_sequence compadd - auto on off' \
        '--size[width and height in pixels]:WxH:' \
        '--seconds[end the runs after so long]:seconds:' \
        '--launches[list the launches of the last runs]' \
        '--json[print JSON]' \
        '--compare[hold against an earlier report]:report:_files -g "*.json"' \
        '--tolerance[new time over old that passes]:ratio:' \
        '--device[device to render on]:device:(cpu gpu)' \
        '--lenient[skip unknown elements of a .rt scene]' \
        '(- *)'{-h,--help}'[list the options]' \
        '*:scene:_files -g "*.(yaml|yml|rt|cfg|nff)"'
}

_glint_accuracy() {
    _arguments \
        '--reference[linear colors to compare with]:picture:_files -g "*.(exr|npy)"' \
        '--precision[how exactly to compute]:list:_sequence compadd - fast single strict double' \
        '--lanes[pixels a work-item carries at once]:list:_sequence compadd - 1 4 8 16' \
        '--bvh[use a BVH]:list:_sequence compadd - auto on off' \
        '--samples[rays for each pixel]:list:' \
        '--bounces[reflections and refractions at most]:number:' \
        '--size[width and height in pixels]:WxH:' \
        '--seconds[end the runs after so long]:seconds:' \
        '--save[where all that is compared goes]:folder:_files -/' \
        '--html[self-contained HTML report]:file:_files -g "*.html"' \
        '--json[print JSON]' \
        '--perturb[err as other devices may]:SEED[\:SCALE]:' \
        '--device[device to render on]:device:(cpu gpu)' \
        '--lenient[skip unknown elements of a .rt scene]' \
        '(- *)'{-h,--help}'[list the options]' \
        '*:scene:_files -g "*.(yaml|yml|rt|cfg|nff)"'
}

_glint() {
    local -a subcommands=(
        'render:render a picture'
        'trace:shoot explicit rays'
        'check:read a scene without rendering it'
        'devices:list the OpenCL devices'
        'diff:tell how far apart two pictures are'
        'bench:tell how fast this device renders scenes'
        'accuracy:tell how fast and how exact each way of rendering is'
        'verify:run the hard cases on a device'
    )
    if ((CURRENT == 2)); then
        _describe -o option "('--version:print the version' '--help:list the subcommands')"
        _describe subcommand subcommands
    elif ((${+functions[_glint_$words[2]]})); then
        shift words
        ((CURRENT--))
        "_glint_$words[1]"
    fi
}

_glint "$@"
