# Completes command lines of glint in fish. The commands are those that --help lists, the options and their choices those of
# --list-options.

function __glint_options
    glint (commandline -opc)[2] --list-options
end

# Prints the choices of the option before the cursor, or returns false.
function __glint_choices
    set -l option (commandline -opc)[-1]
    set -l found $option D 'cpu gpu'
    if test $option = --device
        set found[3] 'cpu gpu all'
    else if test $option != --reference-device
        set found (__glint_options | string match -r -- '^(?:-. )?'(string escape --style=regex -- $option)'\t([^\t[]+)\t([^\t]+)\t')
        or return
    end
    set -l choices (string split ' ' $found[3])
    if test $found[2] = LIST
        __fish_append , $choices
    else
        printf '%s\n' $choices
    end
end

complete -c glint -f
complete -c glint -n __fish_use_subcommand -a '(glint --help | string replace -rf "^  (\w+)  +(.*)" "\$1\t\$2")'
complete -c glint -n __fish_use_subcommand -F
complete -c glint -n 'not __fish_use_subcommand; and string match -q -- "-*" (commandline -ct)' -a '(__glint_options | string replace -r "^.*?(--[a-z-]+)\t[^\t]*\t[^\t]*\t([^\t]*).*" "\$1\t\$2")'
complete -c glint -n 'not __fish_use_subcommand; and not __glint_choices >/dev/null' -F
complete -c glint -n 'not __fish_use_subcommand' -a '(__glint_choices)'
