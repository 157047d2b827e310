# Completes command lines of glint in fish. The commands and options, with what they do, are those that --help lists.

function __glint_options
    glint (commandline -opc)[2] --help | string replace -rf '^ +(?:-\w, )?(--[a-z-]+)\S*(?: \S+)?(?:  +(.*))?$' '$1\t$2'
end

function __glint_precisions
    glint (commandline -opc)[2] --help | string match -e -- --precision | string replace -r ' \(.*' '' |
        string match -ar 'single|strict|double|certified'
end

function __glint_aovs
    glint render --help | string replace -rf '^ {26}(\w+): .*' '$1'
end

# Returns whether the previous word is one of these options.
function __glint_after
    contains -- (commandline -opc)[-1] $argv
end

complete -c glint -f
complete -c glint -n __fish_use_subcommand -a '(glint --help | string replace -rf "^  (\w+)  +(.*)" "\$1\t\$2")'
complete -c glint -n __fish_use_subcommand -F
complete -c glint -n 'not __fish_use_subcommand; and string match -q -- "-*" (commandline -ct)' -a '(__glint_options)'
complete -c glint -n 'not __fish_use_subcommand; and not __glint_after --precision --lanes --bvh --bits --transfer --tone --aov' -F
complete -c glint -n '__glint_after --precision' -a '(__glint_precisions)'
complete -c glint -n '__glint_after --lanes' -a '1 4 8 16'
complete -c glint -n '__glint_after --bvh' -a 'auto on off'
complete -c glint -n '__glint_after --bits' -a '8 16'
complete -c glint -n '__glint_after --transfer' -a 'srgb none'
complete -c glint -n '__glint_after --tone' -a 'none filmic'
complete -c glint -n '__glint_after --device' -a 'cpu gpu all'
complete -c glint -n '__glint_after --reference-device' -a 'cpu gpu'
complete -c glint -n '__glint_after --aov' -a '(__fish_append , (__glint_aovs))'
