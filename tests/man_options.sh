#!/bin/bash
# The keys of the window are those of docs/view.md. The options of each command are the same in its --help, in the manual page, which tools/man-options writes, and in the
# completions of three shells.
set -euo pipefail
cd "$(dirname "$0")/.."
GLINT=${GLINT:-build/glint}
"$GLINT" --version >/dev/null

# Options that stand in the text, one a line; all but -h and --help, which are looked for on their own.
options() {
    { grep -oE '(^|[^a-zA-Z=-])--?[a-zA-Z][a-z-]*' || true; } | sed 's/^[^-]*//; /^-h$/d; /^--help$/d' | sort -u
}

# Of a help line only what stands before the gap counts: the description may speak of other options.
in_help() { "$GLINT" "$1" --help 2>&1 | sed -n 's/^ *\(-.*\)/\1/p' | sed 's/  .*//' | options; }

in_bash() { (. tools/completions/glint.bash && _glint_options "$1" | options); }

in_zsh() {
    sed -n "/^_glint_$1()/,/^}/p" tools/completions/glint.zsh |
        sed -nE "s/^ *'(\\(.*\\)')?([-{])/\\2/p" | sed 's/\[.*//' | options
}

in_fish() {
    { grep -E "__fish_seen_subcommand_from [a-z ]*\<$1\>" tools/completions/glint.fish || true; } |
        sed -E "s/ -d '.*//; s/^.*seen_subcommand_from[^']*'//; s/ -s ([a-zA-Z])/ -\1/; s/ -l ([a-z])/ --\1/; s/ -[FkrxXa]\>//g" |
        options
}

failed=0
subcommands='render view trace check devices diff bench accuracy certify verify cache'
for subcommand in $subcommands; do
    help=$(in_help "$subcommand")
    if [ -z "$help" ]; then
        echo "glint $subcommand --help lists no options"
        failed=1
        continue
    fi
    last=$("$GLINT" "$subcommand" --help | tail -n 1)
    case $last in
    '  -h, --help  '*) ;;
    *)
        echo "glint $subcommand --help ends with '$last', not with -h, --help"
        failed=1
        ;;
    esac
    for place in bash zsh fish; do
        if ! difference=$(diff <(echo "$help") <("in_$place" "$subcommand")); then
            echo "glint $subcommand: --help (<) and $place (>) differ:"
            echo "$difference" | grep '^[<>]'
            failed=1
        fi
    done
done

page=$(mktemp)
trap 'rm -f "$page"' EXIT
cp docs/glint.1 "$page"
tools/man-options "$GLINT" "$page"
for subcommand in $subcommands; do grep -q "options $subcommand\$" "$page" || { echo "docs/glint.1 has no options of $subcommand"; failed=1; }; done
diff docs/glint.1 "$page" || failed=1

# What mouse and keys do in the window.
keys=$("$GLINT" view --help | sed -n '3,/^$/s/^  \(.*[^ ]\)   *\([^ ].*\)$/| \1 | \2 |/p' | sed 's/ * |/ |/')
diff <(echo "$keys") <(sed -n '/^<!-- keys/,/^<!-- end/{/^| [^|]/p}' docs/view.md) || failed=1

listed=$("$GLINT" --help | sed -n 's/^  \([a-z]*\)  .*/\1/p' | xargs)
if [ "$listed" != "$subcommands" ]; then
    echo "glint --help lists the commands '$listed', not '$subcommands'"
    failed=1
fi

# bash's completion at work: $1 is what stands on the line, $2 what it should offer.
offers() {
    local offered
    offered=$(
        . tools/completions/glint.bash
        read -ra COMP_WORDS <<<"$1"
        case $1 in *' ') COMP_WORDS+=('') ;; esac
        COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
        _glint
        echo "${COMPREPLY[*]}"
    )
    [ "$offered" = "$2" ] || {
        echo "completion of '$1' offers '$offered', not '$2'"
        failed=1
    }
}
offers 'glint r' render
offers 'glint render --si' --size
offers 'glint check --le' --lenient
offers 'glint render --lanes 1' '1 16'
offers 'glint render --timing = j' json
glint() { "$GLINT" "$@"; }
offers 'glint render --aov no' normal
offers 'glint render --timing LICEN' LICENSE
exit $failed
