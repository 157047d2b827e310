#!/bin/bash
# The numbers of glint diff against numpy and flip-evaluator, from PyPI: tests/metrics_reference.py.
. "$(dirname "$0")/support.bash"

python=python3
if ! $python -c 'import numpy, flip_evaluator' 2>/dev/null; then
    command -v python3 >/dev/null || skip_all "there is no python3"
    folder=$scratch/venv
    python=$folder/bin/python
    { python3 -m venv "$folder" && timeout 300 "$python" -m pip install -q --no-input numpy flip-evaluator==1.7; } \
        >"$scratch/pip.log" 2>&1 ||
        skip_all "numpy and flip-evaluator are not here, and pip cannot install them: $(tail -n 1 "$scratch/pip.log")"
fi
mkdir "$scratch/pictures"
check "glint diff agrees with numpy and flip-evaluator" "$python" tests/metrics_reference.py "$GLINT" "$scratch/pictures"
finish
