# Provides what the shell tests share, which source it first. GLINT is the program under test, $build the folder BUILD for
# what a test builds, and $make the make to use.
# Kernel caches, glint's own and the drivers', are those of XDG_CACHE_HOME, shared by the tests of a run; $scratch is removed in
# the end.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 1
GLINT=$(realpath "${GLINT:-build/glint}") || exit 1
[ -x "$GLINT" ] || { echo "there is no program $GLINT: make, or set GLINT"; exit 1; }
build=${BUILD:-build} make=${MAKE:-make}
export LC_ALL=C
unset GLINT_DEVICE

scratch=$(mktemp -d) || exit 1
trap 'rm -rf "$scratch"' EXIT
export XDG_CACHE_HOME=${XDG_CACHE_HOME:-$HOME/.cache} TMPDIR=$scratch

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
# Ends the test, with status 1 if a check failed or none was made.
finish() {
    echo "$passed checks passed, $failed failed"
    [ $failed = 0 ] && [ $passed -gt 0 ]
    exit
}
skip_all() {
    echo "skipped: $*"
    exit 77
}
# python_with MODULE[=REQUIREMENT]…: sets `python` to a Python that has the modules: $PYTHON or python3, the system's, else
# a virtual environment above the system's, which the tests of a run share. There pip installs what is missing, by the
# module's name if no requirement is given. A requirement may be several, with spaces between. Skips the test if that fails.
# Once pip had no network, no test asks it for ten minutes.
python_with() {
    local import module missing=() folder=$XDG_CACHE_HOME/glint-tests
    local log=$scratch/pip.log offline=$folder/offline lock
    import="import $(IFS=,; echo "${*%%=*}")"
    for python in "${PYTHON:-python3}" /usr/bin/python3; do
        "$python" -c "$import" 2>/dev/null && return
    done
    [ -x "$python" ] || python=${PYTHON:-python3}
    command -v "$python" >/dev/null || skip_all "there is no $python"
    # tests run at the same time and must do this one after another
    mkdir -p "$folder" && exec {lock}>"$folder/lock" && flock "$lock"
    [ -x "$folder/python/bin/pip" ] ||
        "$python" -m venv --clear --system-site-packages "$folder/python" >"$log" 2>&1 ||
        skip_all "${*%%=*}: not here, and no virtual environment can be made: $(tail -n 1 "$log")"
    python=$folder/python/bin/python
    for module; do "$python" -c "import ${module%%=*}" 2>/dev/null || missing+=(${module#*=}); done
    if [ ${#missing[@]} -gt 0 ]; then
        [ ! "$(find "$offline" -mmin -10 2>/dev/null)" ] || skip_all "${missing[*]}: not here, and pip had no network"
        timeout 300 "$python" -m pip install -q --no-input "${missing[@]}" >"$log" 2>&1
        local status=$?
        if [ $status = 124 ] || grep -qi 'connection broken' "$log"; then touch "$offline"; fi
        [ $status = 0 ] && "$python" -c "$import" 2>"$log" ||
            skip_all "${missing[*]}: not here, and pip cannot install them: $(tail -n 1 "$log")"
    fi
    exec {lock}>&-
}
is_long() { [ "${GLINT_LONG_TESTS-}" = 1 ]; }
is_sanitized() { case $(dirname "$GLINT") in *-sanitize) true ;; *) false ;; esac; }
