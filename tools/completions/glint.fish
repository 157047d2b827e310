# Completion of glint for fish; the options of each subcommand are held to its --help by tests/man_options.sh.

complete -c glint -f
complete -c glint -n __fish_use_subcommand -a render -d 'Render a picture'
complete -c glint -n __fish_use_subcommand -a trace -d 'Shoot explicit rays'
complete -c glint -n __fish_use_subcommand -a check -d 'Read a scene without rendering it'
complete -c glint -n __fish_use_subcommand -a devices -d 'List the OpenCL devices'
complete -c glint -n __fish_use_subcommand -l version -d 'Print the version'
complete -c glint -n __fish_use_subcommand -l help -d 'List the subcommands'

complete -c glint -n '__fish_seen_subcommand_from render trace check' -F -k
complete -c glint -n '__fish_seen_subcommand_from render trace check devices' -s h -l help -d 'List the options'
complete -c glint -n '__fish_seen_subcommand_from render trace' -s o -l output -r -F -d 'Where the result goes'
complete -c glint -n '__fish_seen_subcommand_from render trace' -l device -x -a 'cpu gpu' -d 'Device'
complete -c glint -n '__fish_seen_subcommand_from render trace' -l precision -x -a 'fast single strict double' -d 'How exactly to compute'
complete -c glint -n '__fish_seen_subcommand_from render trace' -l lanes -x -a '1 4 8 16' -d 'Pixels or rays a work-item carries'
complete -c glint -n '__fish_seen_subcommand_from render trace' -l no-cache -d 'Build the kernel anew'
complete -c glint -n '__fish_seen_subcommand_from render trace check' -l lenient -d 'Skip unknown elements of a .rt scene'
complete -c glint -n '__fish_seen_subcommand_from check devices' -l json -d 'For programs'
complete -c glint -n '__fish_seen_subcommand_from trace' -l rays -r -F -d 'File of rays'
complete -c glint -n '__fish_seen_subcommand_from render' -l size -x -d 'Width and height, as WxH'
complete -c glint -n '__fish_seen_subcommand_from render' -l samples -x -d 'Rays for each pixel'
complete -c glint -n '__fish_seen_subcommand_from render' -l region -x -d 'Pixels to render, as X,Y,W,H'
complete -c glint -n '__fish_seen_subcommand_from render' -l aov -x -a 't normal position object shadow color' -d 'Other things than the picture'
complete -c glint -n '__fish_seen_subcommand_from render' -l timing -d 'How long each stage took'
complete -c glint -n '__fish_seen_subcommand_from render' -l transfer -x -a 'srgb none' -d 'Curve to display values'
complete -c glint -n '__fish_seen_subcommand_from render' -l bits -x -a '8 16' -d 'Bits a channel'
complete -c glint -n '__fish_seen_subcommand_from render' -l quiet -d 'No progress'
