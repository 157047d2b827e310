#!/bin/bash
# The numbers of glint diff against numpy and flip-evaluator, from PyPI: tests/metrics_reference.py.
. "$(dirname "$0")/support.bash"

python_with numpy=numpy==2.4.6 flip_evaluator=flip-evaluator==1.7
mkdir "$scratch/pictures"
check "glint diff agrees with numpy and flip-evaluator" "$python" tests/metrics_reference.py "$GLINT" "$scratch/pictures"
finish
