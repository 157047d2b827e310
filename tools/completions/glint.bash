# Completes command lines of glint in bash. The commands are those that --help lists, the options and their choices those of
# --list-options.

_glint() {
    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} options argument='[^[]' words=
    COMPREPLY=()
    if [ "$COMP_CWORD" -eq 1 ]; then
        compopt -o filenames 2>/dev/null
        words=$(glint --help | sed -n 's/^  \([a-z][a-z]*\)  .*/\1/p')
        mapfile -t COMPREPLY < <(compgen -W "$words --version --help" -- "$word"; compgen -f -- "$word")
        return
    fi
    # bash splits --option=value into three words. An argument in brackets needs the =.
    if [ "$word" = = ]; then word= argument=; elif [ "$before" = = ]; then before=${COMP_WORDS[COMP_CWORD - 2]} argument=; fi
    options=$(glint "${COMP_WORDS[1]}" --list-options)
    case $before in
    --device) words="cpu gpu all" ;;
    --reference-device) words="cpu gpu" ;;
    --*) words=$(grep -E -e "^(-. )?$before	$argument" <<<"$options" | cut -f 3) ;;
    esac
    [ -n "$words" ] || case $word in -*) words=$(cut -f 1 <<<"$options") ;; esac
    if [ -n "$words" ]; then
        mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
    else
        compopt -o filenames 2>/dev/null
        mapfile -t COMPREPLY < <(compgen -f -- "$word")
    fi
}

complete -F _glint glint
