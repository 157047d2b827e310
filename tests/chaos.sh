#!/bin/bash
# Runs tools/chaos for a short time. What glint relies on fails, and glint must keep its promises (docs/design.md).
# GLINT_LONG_TESTS=1 runs it for longer.
. "$(dirname "$0")/support.bash"
is_sanitized && skip_all 'a sanitized build replaces the allocators and handlers'
unset OCL_ICD_VENDORS
seconds=8
! is_long || seconds=55
tools/chaos --seconds $seconds --glint "$GLINT" && tools/chaos --seconds 5 --only 'render plain' --glint "$GLINT" kills
