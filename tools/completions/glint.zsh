#compdef glint
# Completion of glint for zsh; the options of each subcommand are checked against its --help by tests/man_options.sh.

_glint_aovs() {
    _sequence "$@" compadd - ${(f)"$(glint render --help | sed -n 's/^ \{26\}\([a-z]*\): .*/\1/p')"}
}

_glint_render() {
    _arguments \
        '(-o --output)'{-o,--output}'[image file to write]:image:_files -g "*.(png|ppm|exr|npy)"' \
        '--size[width and height in pixels]:WxH:' \
        '--samples[rays for each pixel]:number:' \
        '--region[pixels of the whole image to render]:X,Y,W,H:' \
        '--device[device to render on, or several]:device:(cpu gpu all)' \
        '--precision[arithmetic]:precision:(fast single strict double certified)' \
        '--lanes[rays per work-item]:lanes:(1 4 8 16)' \
        '--bvh[use a BVH]:choice:(auto on off)' \
        '--bounces[reflections and refractions at most]:number:' \
        '--aov[more files beside the image]:names:_glint_aovs' \
        '--max-error[error that the precision must keep]:E[\:METRIC]:' \
        '--timing=-[report the time of every stage]::form:(json)' \
        '--transfer[curve from linear light to display values]:curve:(srgb none)' \
        '--bits[bits per channel]:bits:(8 16)' \
        '--no-cache[build the kernel anew]' \
        '--perturb[inject the rounding error that OpenCL permits]:SEED[\:SCALE]:' \
        '--lenient[skip unknown elements of a .rt scene]' \
        '--max-pixels[largest image that is read]:number:' \
        '--checkpoint[go on from this file, and keep what is rendered]:file:_files' \
        '--quiet[no progress]' \
        '(- *)'{-h,--help}'[list the options]' \
        '1:scene:_files -g "*.(yaml|yml|rt|cfg|nff)"'
}

_glint_view() {
    _arguments \
        '--size[width and height in pixels]:WxH:' \
        '--samples[rays for each pixel at rest]:number:' \
        '--write-camera[C writes the camera into the scene file]' \
        '--device[device to render on]:device:(cpu gpu)' \
        '--precision[arithmetic]:precision:(fast single strict double certified)' \
        '--lanes[rays per work-item]:lanes:(1 4 8 16)' \
        '--bvh[use a BVH]:choice:(auto on off)' \
        '--bounces[reflections and refractions at most]:number:' \
        '--no-cache[build the kernel anew]' \
        '--lenient[skip unknown elements of a .rt scene]' \
        '--max-pixels[largest image that is read]:number:' \
        '(- *)'{-h,--help}'[list the options]' \
        '1:scene:_files -g "*.(yaml|yml|rt|cfg|nff)"'
}

_glint_trace() {
    _arguments \
        '--rays[file of rays]:rays:_files' \
        '(-o --output)'{-o,--output}'[where the CSV goes]:file:_files' \
        '--device[device to trace on]:device:(cpu gpu)' \
        '--precision[arithmetic]:precision:(fast single strict double)' \
        '--lanes[rays per work-item]:lanes:(1 4 8 16)' \
        '--bvh[use a BVH]:choice:(auto on off)' \
        '--no-cache[build the kernel anew]' \
        '--perturb[inject the rounding error that OpenCL permits]:SEED[\:SCALE]:' \
        '--lenient[skip unknown elements of a .rt scene]' \
        '--max-pixels[largest image that is read]:number:' \
        '(- *)'{-h,--help}'[list the options]' \
        '1:scene:_files -g "*.(yaml|yml|rt|cfg|nff)"'
}

_glint_check() {
    _arguments \
        '--json[print JSON]' \
        '--object=[what object an ID is of]:ID' \
        '--lenient[skip unknown elements of a .rt scene]' \
        '(- *)'{-h,--help}'[list the options]' \
        '1:scene:_files -g "*.(yaml|yml|rt|cfg|nff)"'
}

_glint_devices() {
    _arguments \
        '--json[print JSON]' \
        '(- *)'{-h,--help}'[list the options]'
}

_glint_certify() {
    _arguments \
        '--size[width and height in pixels]:WxH:' \
        '--pixels[of the sample, about]:number:' \
        '--precision[arithmetic, separated by commas]:precisions:(fast single strict double certified)' \
        '--lanes[rays per work-item]:lanes:(1 4 8 16)' \
        '--bvh[use a BVH]:choice:(auto on off)' \
        '--bounces[reflections and refractions at most]:number:' \
        '--device[device to render on]:device:(cpu gpu)' \
        '--no-cache[build the kernels anew]' \
        '--lenient[skip unknown elements of a .rt scene]' \
        '--max-pixels[largest image that is read]:number:' \
        '--perturb[inject the rounding error that OpenCL permits]:SEED[\:SCALE]:' \
        '--json[print JSON]' \
        '(- *)'{-h,--help}'[list the options]' \
        '1:scene:_files -g "*.(yaml|yml|rt|cfg|nff)"'
}

_glint_verify() {
    _arguments \
        '--device[device to verify]:device:(cpu gpu)' \
        '--precision[arithmetic]:precision:(fast single strict double)' \
        '--lanes[rays per work-item]:lanes:(1 4 8 16)' \
        '--no-cache[build the kernels anew]' \
        '--perturb[inject the rounding error that OpenCL permits]:SEED[\:SCALE]:' \
        '--lean[build small kernels, for a slow compiler]' \
        '--json[print JSON]' \
        '(- *)'{-h,--help}'[list the options]'
}

_glint_cache() {
    _arguments \
        '--clear[remove all programs]' \
        '(- *)'{-h,--help}'[list the options]'
}

_glint_diff() {
    _arguments \
        '--heatmap[image of the differences]:image:_files -g "*.(png|ppm|exr|npy)"' \
        '--max-pixels[largest image that is read]:number:' \
        '--json[print JSON]' \
        '(- *)'{-h,--help}'[list the options]' \
        '1:reference:_files -g "*.(png|ppm|exr|npy)"' \
        '2:image:_files -g "*.(png|ppm|exr|npy)"'
}

_glint_bench() {
    _arguments \
        '--precision[arithmetic]:list:_sequence compadd - fast single strict double certified' \
        '--lanes[rays per work-item]:list:_sequence compadd - 1 4 8 16' \
        '--bvh[use a BVH]:list:_sequence compadd - auto on off' \
        '--size[width and height in pixels]:WxH:' \
        '--seconds[stop the runs after this many seconds]:seconds:' \
        '--launches[list the launches of the last runs]' \
        '--json[print JSON]' \
        '--compare[compare with an earlier report]:report:_files -g "*.json"' \
        '--against[compare with another build]:program:_files' \
        '--worker[answer the option --against of another glint]' \
        '--tolerance[ratio of times that are the same]:ratio:' \
        '--samples[per pixel, a row each]:list:' \
        '--bounces[reflections and refractions at most]:number:' \
        '--device[device to render on]:device:(cpu gpu)' \
        '--lenient[skip unknown elements of a .rt scene]' \
        '--max-pixels[largest image that is read]:number:' \
        '(- *)'{-h,--help}'[list the options]' \
        '*:scene:_files -g "*.(yaml|yml|rt|cfg|nff)"'
}

_glint_accuracy() {
    _arguments \
        '--budget[errors to allow]:list:' \
        '--reference[linear colors to compare with]:image:_files -g "*.(exr|npy)"' \
        '--precision[arithmetic]:list:_sequence compadd - fast single strict double certified' \
        '--lanes[rays per work-item]:list:_sequence compadd - 1 4 8 16' \
        '--bvh[use a BVH]:list:_sequence compadd - auto on off' \
        '--samples[rays for each pixel]:list:' \
        '--bounces[reflections and refractions at most]:number:' \
        '--size[width and height in pixels]:WxH:' \
        '--seconds[stop the runs after this many seconds]:seconds:' \
        '--save[where all that is compared goes]:folder:_files -/' \
        '--html[self-contained HTML report]:file:_files -g "*.html"' \
        '--json[print JSON]' \
        '--perturb[inject the rounding error that OpenCL permits]:SEED[\:SCALE]:' \
        '--device[device to render on]:device:(cpu gpu)' \
        '--lenient[skip unknown elements of a .rt scene]' \
        '--max-pixels[largest image that is read]:number:' \
        '(- *)'{-h,--help}'[list the options]' \
        '*:scene:_files -g "*.(yaml|yml|rt|cfg|nff)"'
}

_glint() {
    local -a subcommands=(
        'render:render an image'
        'view:show a scene in a window'
        'trace:shoot explicit rays'
        'check:read a scene without rendering it'
        'devices:list the OpenCL devices'
        'diff:compare two images'
        'bench:benchmark scenes on this device'
        'accuracy:report time and error of every configuration'
        'certify:compare an image with a reference of quadruple precision'
        'verify:run the hard cases on a device'
        'cache:list, check or empty the kernel cache'
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
