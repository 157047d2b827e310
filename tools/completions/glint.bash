# Completes command lines of glint in bash. The commands and options are those that --help lists.

_glint_commands() { glint --help | sed -n 's/^  \([a-z][a-z]*\)  .*/\1/p'; }

_glint_options() {
    glint "$1" --help | sed -n 's/^ *\(-.*\)/\1/p' | sed 's/  .*//' | grep -oE -e '--?[a-zA-Z][a-z-]*'
}

_glint_precisions() {
    glint "$1" --help | sed -n '/--precision/s/ (.*//p' | grep -oE 'single|strict|double|certified'
}

_glint() {
    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} subcommand=${COMP_WORDS[1]} words=
    COMPREPLY=()
    if [ "$COMP_CWORD" -eq 1 ]; then
        compopt -o filenames 2>/dev/null
        mapfile -t COMPREPLY < <(compgen -W "$(_glint_commands) --version --help" -- "$word"; compgen -f -- "$word")
        return
    fi
    # bash splits --option=value into three words.
    if [ "$word" = = ]; then word=; elif [ "$before" = = ]; then before=${COMP_WORDS[COMP_CWORD - 2]}; fi
    case $before in
    --precision) words=$(_glint_precisions "$subcommand") ;;
    --lanes) words="1 4 8 16" ;;
    --bvh) words="auto on off" ;;
    --bits) words="8 16" ;;
    --transfer) words="srgb none" ;;
    --format) [ "$subcommand" = render ] && words="png ppm npy" ;;
    --tone) words="none filmic" ;;
    --device) words="cpu gpu all" ;;
    --reference-device) words="cpu gpu" ;;
    --aov) words=$(glint render --help | sed -n 's/^ \{26\}\([a-z]*\): .*/\1/p') ;;
    --timing) [ "${COMP_WORDS[COMP_CWORD - 1]}" = = ] && words="json trace" ;;
    esac
    [ -n "$words" ] || case $word in -*) words=$(_glint_options "$subcommand") ;; esac
    if [ -n "$words" ]; then
        mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
    else
        compopt -o filenames 2>/dev/null
        mapfile -t COMPREPLY < <(compgen -f -- "$word")
    fi
}

complete -F _glint glint
