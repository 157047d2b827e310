# Completion of glint for bash; the options of each subcommand are checked against its --help by tests/man_options.sh.

_glint_options() {
    case ${1-} in
    render) echo "-o --output --size --samples --region --device --precision --lanes --bvh --bounces --aov" \
        "--max-error --timing --transfer --bits --no-cache --lenient --max-pixels --perturb --checkpoint" \
        "--quiet -h --help" ;;
    view) echo "--size --samples --bounces --write-camera --device --precision --lanes --bvh --no-cache --lenient --max-pixels -h --help" ;;
    trace) echo "--rays -o --output --device --precision --lanes --bvh --no-cache --lenient --max-pixels --perturb -h --help" ;;
    check) echo "--json --object --lenient -h --help" ;;
    devices) echo "--json -h --help" ;;
    diff) echo "--heatmap --max-pixels --json -h --help" ;;
    bench) echo "--precision --lanes --bvh --size --seconds --launches --json --compare --against --worker" \
        "--tolerance --samples --bounces --device --lenient --max-pixels -h --help" ;;
    accuracy) echo "--reference --budget --precision --lanes --bvh --samples --bounces --size --seconds --save --html --json" \
        "--perturb --device --lenient --max-pixels -h --help" ;;
    certify) echo "--size --pixels --precision --lanes --bvh --bounces --device --no-cache --lenient --max-pixels --perturb --json -h --help" ;;
    verify) echo "--device --precision --lanes --no-cache --perturb --lean --json -h --help" ;;
    cache) echo "--clear -h --help" ;;
    *) echo "--version --help" ;;
    esac
}

_glint() {
    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} subcommand=${COMP_WORDS[1]} words=
    COMPREPLY=()
    if [ "$COMP_CWORD" -eq 1 ]; then
        mapfile -t COMPREPLY < <(compgen -W "render view trace check devices diff bench accuracy certify verify cache $(_glint_options)" -- "$word")
        return
    fi
    # bash splits --option=value into three words.
    if [ "$word" = = ]; then word=; elif [ "$before" = = ]; then before=${COMP_WORDS[COMP_CWORD - 2]}; fi
    case $before in
    --precision)
        words="fast single strict double"
        case $subcommand in trace | verify) ;; *) words="$words certified" ;; esac
        ;;
    --lanes) words="1 4 8 16" ;;
    --bvh) words="auto on off" ;;
    --bits) words="8 16" ;;
    --transfer) words="srgb none" ;;
    --device) words="cpu gpu all" ;;
    --aov) words=$(glint render --help | sed -n 's/^ \{26\}\([a-z]*\): .*/\1/p') ;;
    --timing) [ "${COMP_WORDS[COMP_CWORD - 1]}" = = ] && words=json ;;
    --size | --pixels | --samples | --region | --bounces | --perturb | --seconds | --tolerance | --max-error | --max-pixels) return ;;
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
