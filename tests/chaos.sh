#!/bin/bash
# The short run of tools/chaos, in which what glint relies on fails and glint keeps its promises (docs/design.md). With
# GLINT_LONG_TESTS=1 it runs tools/chaos --long. A sanitized build replaces the allocators and handlers.
set -euo pipefail
cd "$(dirname "$0")/.."
BUILD=${BUILD:-build}
case $BUILD in *-sanitize)
    echo "not with sanitizers"
    exit 77
    ;;
esac
unset OCL_ICD_VENDORS GLINT_DEVICE
seconds=6
[ "${GLINT_LONG_TESTS-}" != 1 ] || seconds=55
exec tools/chaos --seconds $seconds --glint "${GLINT:-$BUILD/glint}"
