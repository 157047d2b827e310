#!/bin/bash
# Runs tools/chaos for a short time. What glint relies on fails, and glint must keep its promises (docs/design.md).
# GLINT_LONG_TESTS=1 runs tools/chaos --long. A sanitized build replaces the allocators and handlers.
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
