#compdef glint
# Completes command lines of glint in zsh. The commands and options, with what they do, are those that --help lists.

_glint() {
    local -a found
    if ((CURRENT == 2)); then
        found=(${(f)"$(glint --help | sed -n 's/^  \([a-z][a-z]*\)  *\(.*\)/\1:\2/p')"})
        _describe command found
        _files
        return
    fi
    local option=$words[CURRENT-1]
    if compset -P '--*='; then option=${IPREFIX%=}; fi
    case $option in
    --precision)
        compadd ${(f)"$(glint $words[2] --help | sed -n '/--precision/s/ (.*//p' | grep -oE 'single|strict|double|certified')"}
        ;;
    --lanes) compadd 1 4 8 16 ;;
    --bvh) compadd auto on off ;;
    --bits) compadd 8 16 ;;
    --transfer) compadd srgb none ;;
    --tone) compadd none filmic ;;
    --device) compadd cpu gpu all ;;
    --reference-device) compadd cpu gpu ;;
    --timing) [[ -n $IPREFIX ]] && compadd json trace || _files ;;
    --aov) _sequence compadd - ${(f)"$(glint render --help | sed -n 's/^ \{26\}\([a-z]*\): .*/\1/p')"} ;;
    *)
        if [[ $PREFIX == -* ]]; then
            found=(${(f)"$(glint $words[2] --help | sed -nE 's/^ +(-[a-z], )?(--[a-z-]+)[^ ]*( [^ ]+)?(  +(.*))?$/\2:\5/p')"})
            _describe -o option found
        else
            _files
        fi
        ;;
    esac
}

_glint "$@"
