# What the shell tests share, to be sourced first. GLINT is the program under test, BUILD the folder it was built in.
# Kernel caches, glint's own and the drivers', start empty; $scratch is removed in the end.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 1
GLINT=$(realpath "${GLINT:-build/glint}") || exit 1
[ -x "$GLINT" ] || { echo "there is no program $GLINT: make, or set GLINT"; exit 1; }
export LC_ALL=C
unset GLINT_DEVICE

scratch=$(mktemp -d) || exit 1
trap 'rm -rf "$scratch"' EXIT
shared_cache=${XDG_CACHE_HOME:-$scratch} # of all tests of a run
export XDG_CACHE_HOME=$scratch/cache TMPDIR=$scratch
mkdir "$XDG_CACHE_HOME"

passed=0 failed=0

pass() { passed=$((passed + 1)); }
fail() {
    failed=$((failed + 1))
    printf 'FAILED: %s\n' "$*"
}
# check WHAT COMMAND…: passes if the command does.
check() {
    local what=$1
    shift
    if "$@" >"$scratch/check.log" 2>&1; then
        pass
    else
        fail "$what"
        sed 's/^/    /' "$scratch/check.log" | head -20
    fi
}
# Ends the test: with 1 if a check failed or none was made.
finish() {
    echo "$passed checks passed, $failed failed"
    [ $failed = 0 ] && [ $passed -gt 0 ]
    exit
}
skip_all() {
    echo "skipped: $*"
    exit 77
}
# python_with MODULE[=REQUIREMENT]…: sets `python` to a Python that has the modules: python3 (or $PYTHON), else a
# virtual environment that the tests of a run share, in which pip installs what is missing (by the module's own name
# where no requirement is given). Skips the test where that cannot be done; once pip had no network, no test asks it for
# ten minutes.
python_with() {
    python=${PYTHON:-python3}
    local modules=("${@%%=*}") folder=$shared_cache/glint-tests/python log=$scratch/pip.log
    local import="import $(IFS=,; echo "${modules[*]}")" offline=$shared_cache/glint-tests/offline
    "$python" -c "$import" 2>/dev/null && return
    command -v "$python" >/dev/null || skip_all "there is no $python"
    # one test after the other: they run beside each other
    mkdir -p "$shared_cache" && local lock && exec {lock}>"$shared_cache/glint-tests.lock" && flock "$lock"
    [ -x "$folder/bin/pip" ] || "$python" -m venv --clear "$folder" >"$log" 2>&1 ||
        skip_all "${modules[*]}: not here, and no virtual environment can be made: $(tail -n 1 "$log")"
    python=$folder/bin/python
    "$python" -c "$import" 2>/dev/null && exec {lock}>&- && return
    [ ! "$(find "$offline" -mmin -10 2>/dev/null)" ] || skip_all "${modules[*]}: not here, and pip had no network"
    timeout 300 "$python" -m pip install -q --no-input "${@#*=}" >"$log" 2>&1
    local status=$?
    if [ $status = 124 ] || grep -qi 'connection broken' "$log"; then touch "$offline"; fi
    [ $status = 0 ] && "$python" -c "$import" 2>"$log" ||
        skip_all "${modules[*]}: not here, and pip cannot install them: $(tail -n 1 "$log")"
    exec {lock}>&-
}
is_sanitized() { case ${BUILD:-$(dirname "$GLINT")} in *-sanitize) true ;; *) false ;; esac; }

# npy_same A B WIDTH: both hold the same bytes, else says at which of their pixels (three floats each) they differ first.
npy_same() {
    local header=128
    cmp -s "$1" "$2" && return
    [ "$(stat -c %s "$1")" = "$(stat -c %s "$2")" ] || { echo "$1 and $2 differ in size"; return 1; }
    cmp -l "$1" "$2" | awk -v h=$header -v w="$3" '
        { value = int(($1 - 1 - h) / 4); pixel = int(value / 3) }
        NR == 1 { place = pixel % w "," int(pixel / w) ", channel " value % 3 }
        pixel != last { count++; last = pixel }
        END { print count " pixels differ, first at " place }'
    return 1
}
