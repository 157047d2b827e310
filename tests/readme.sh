#!/bin/bash
# The README's examples: what a command prints there it prints today, number for number where nothing is timed, else line
# for line with another number, hash or name of a device in its place.
. "$(dirname "$0")/support.bash"

# example COMMAND: the lines that stand under "$ COMMAND" in the README, without their indentation.
example() {
    awk -v command="    \$ $1" '
        $0 == command { within = 1; next }
        within && !/^    / && !/^$/ { exit }
        /^    \$ / { if (within) exit }
        within { sub(/^    /, ""); lines[++count] = $0 }
        END { while (count && lines[count] == "") count--; for (i = 1; i <= count; i++) print lines[i] }' README.md
}
# Numbers, hashes, devices and columns made alike.
shape() {
    sed -E 's/\(kernel [0-9a-f]+\)/(kernel H)/; s/\b[0-9a-f]{16}\b/H/g; s/[-+]?[0-9.]+(e[-+]?[0-9]+)?|inf/N/g; s/ on .* \(/ on D (/; s/ +/ /g; s/ $//' |
        grep -v -e 'Portable Computing Language' -e '^measured peak' -e '^ for an error of' -e 'crossed out' | sort -u
}
exact() {
    check "README: $1" test -n "$(example "$1")"
    check "README: what $1 prints" diff <(example "$1") <(sh -c "PATH=$scratch:\$PATH; ${2:-$1}")
}
alike() {
    check "README: $1" test -n "$(example "$1")"
    check "README: lines of $1" diff <(example "$1" | shape) <(sh -c "PATH=$scratch:\$PATH; $2" 2>&1 | shape)
}

ln -s "$GLINT" "$scratch/glint"
example 'cat rays.txt' >"$scratch/rays.txt"
for precision in '' ' --precision double'; do
    command="glint trace scenes/article.yaml --rays rays.txt$precision"
    exact "$command" "${command/rays.txt/$scratch/rays.txt}"
done
exact 'glint check scenes/article.yaml'

render='glint render scenes/demo.yaml -o demo.png --timing'
sh -c "PATH=$scratch:\$PATH; glint render scenes/demo.yaml --quiet -o $scratch/demo.png"
alike "$render" "${render/demo.png/$scratch/demo.png}"
bench='glint bench scenes/spheres16.yaml --size 640x360 --precision fast,single,strict,double'
alike "$bench" "$bench --seconds 0.01"
is_sanitized || alike 'glint accuracy scenes/far-planet.yaml --size 320x180' 'glint accuracy scenes/far-planet.yaml --size 320x180 --seconds 0.01'
finish
