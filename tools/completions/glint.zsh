#compdef glint
# Completes command lines of glint in zsh. The commands are those that --help lists, the options and their choices those of
# --list-options.

_glint() {
    local -a found options fields
    if ((CURRENT == 2)); then
        found=(${(f)"$(glint --help | sed -n 's/^  \([a-z][a-z]*\)  *\(.*\)/\1:\2/p')"})
        _describe command found
        _files
        return
    fi
    local option=$words[CURRENT-1] tab=$'\t'
    if compset -P '--*='; then option=${IPREFIX%=}; fi
    options=(${(f)"$(glint $words[2] --list-options)"})
    fields=(${(M)options:#(|-? )$option$tab*})
    fields=("${(@ps:\t:)fields[1]}") # names, argument, choices, help
    case $option in
    --device) fields[3]="cpu gpu all" ;;
    --reference-device) fields[3]="cpu gpu" ;;
    esac
    if [[ -n $fields[3] && ( $fields[2] != \[* || -n $IPREFIX ) ]]; then
        if [[ $fields[2] == LIST ]]; then _sequence compadd - ${=fields[3]}; else compadd ${=fields[3]}; fi
    elif [[ $PREFIX == -* ]]; then
        for fields in $options; do
            fields=("${(@ps:\t:)fields}")
            found+=("${fields[1]##* }:$fields[4]")
        done
        _describe -o option found
    else
        _files
    fi
}

_glint "$@"
