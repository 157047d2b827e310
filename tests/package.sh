#!/bin/bash
# Tests tools/package. Two clones of one commit in different folders, with other permissions for new files, give the same
# packages and source package, in which lintian finds no error. It runs in long tests only, and is the same whatever is under
# test.
# run_tests: sanitize-long-only
. "$(dirname "$0")/support.bash"
is_long || skip_all "only with GLINT_LONG_TESTS=1"
git rev-parse --verify -q HEAD >/dev/null || skip_all "this is not a clone"
for package in build-essential debhelper libopenmpi-dev; do
    dpkg -s $package >/dev/null 2>&1 || skip_all "$package is not here"
done

# package FOLDER UMASK: builds the packages of a clone in the folder, into FOLDER/out
package() (
    umask "$2"
    git clone -q . "$1/glint" && "$1/glint/tools/package" deb "$1/out"
)
# AppStream 1.0 asks for a homepage, which glint does not have. Older releases of lintian do not know this tag.
packages_lint() {
    lintian --fail-on error,warning --suppress-tags appstream-metadata-validation-failed "$1" || lintian --fail-on error,warning "$1"
}
mkdir -p "$scratch/one" "$scratch/two/deeper"
check "packages" package "$scratch/one" 022
check "packages of a clone elsewhere" package "$scratch/two/deeper" 077
# .buildinfo records when and where it was built, and .changes has its hash
for file in "$scratch"/one/out/*.deb "$scratch"/one/out/*.tar.* "$scratch"/one/out/*.dsc; do
    check "${file##*/} is the same in both" cmp "$file" "$scratch/two/deeper/out/${file##*/}"
done
! command -v lintian >/dev/null || check "lintian" packages_lint "$scratch"/one/out/*.changes
finish
