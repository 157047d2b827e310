#!/bin/bash
# Checks that the options of each command and the keys of the window are the same in its --help and in the manual pages, which
# tools/man-options writes, and that glint-scene(5) is what tools/man-scene writes. Completion must offer what --help lists.
set -euo pipefail
cd "$(dirname "$0")/.."
GLINT=${GLINT:-build/glint}
"$GLINT" --version >/dev/null

failed=0
subcommands='render view trace check devices diff bench accuracy certify verify golden report cache'
for subcommand in $subcommands; do
    last=$("$GLINT" "$subcommand" --help | tail -n 1)
    case $last in
    '  -h, --help  '*) ;;
    *)
        echo "glint $subcommand --help ends with '$last', not with -h, --help"
        failed=1
        ;;
    esac
done

pages=$(mktemp -d)
trap 'rm -rf "$pages"' EXIT
cp docs/glint*.1 "$pages"
tools/man-options "$GLINT" "$pages"/*
for subcommand in $subcommands; do grep -q "options $subcommand\$" "$pages"/* || { echo "no manual page has options of $subcommand"; failed=1; }; done
tools/man-scene docs/scene-format.md >"$pages/glint-scene.5"
for page in "$pages"/*; do diff "docs/${page##*/}" "$page" || failed=1; done

listed=$("$GLINT" --help | sed -n 's/^  \([a-z][a-z]*\)  .*/\1/p' | xargs)
if [ "$listed" != "$subcommands" ]; then
    echo "glint --help lists the commands '$listed', not '$subcommands'"
    failed=1
fi

# Checks what bash's completion offers, where $1 is on the line and $2 is what it should offer.
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
glint() { "$GLINT" "$@"; }
offers 'glint ren' render
offers 'glint LICEN' LICENSE
offers 'glint render --si' --size
offers 'glint scenes/demo.yaml --si' --size
offers 'glint check --le' --lenient
offers 'glint render --lanes 1' '1 16'
offers 'glint render --tone f' filmic
offers 'glint render --format p' 'png ppm'
offers 'glint verify --format j' 'json junit'
offers 'glint diff --format b' ''
offers 'glint bench --format b' benchmark
offers 'glint bench --device g' gpu
offers 'glint render --precision ' 'single strict double certified'
offers 'glint trace --precision ' 'single strict double certified'
offers 'glint render --timing = j' json
offers 'glint render --aov no' normal
offers 'glint render --timing LICEN' LICENSE
if command -v fish >/dev/null; then
    offered=$(PATH=$(dirname "$(realpath "$GLINT")"):$PATH fish -c '. tools/completions/glint.fish
        for line in "render --la" "verify --format ju" "render --device g" "bench --bvh on,of" "render LICEN"
            complete -C "glint $line"
        end')
    [ "$offered" = "--lanes	rays per work-item: 1, 4, 8 or 16 (default and CPU maximum: vector width)
junit
gpu
on,off
LICENSE" ] || {
        echo "fish offers '$offered'"
        failed=1
    }
fi
exit $failed
