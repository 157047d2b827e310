#!/bin/bash
# Tests make install and uninstall: files go where the variables say and nowhere else, and the installed programs work. The
# user's flags reach every command of a build, and neither flags nor folders are compiled in. Archives by git know their commit.
. "$(dirname "$0")/support.bash"
version=$(sed -n 's/^VERSION := //p' Makefile)

# AppStream 1.0 asks for a homepage, which glint does not have. Version 0.16 does not know the name of that question.
metadata_validate() {
    appstreamcli validate --no-net --override=url-homepage-missing=info "$1" || appstreamcli validate --no-net "$1"
}

check "CHANGELOG.md's latest version is $version" test "$(grep -om 1 '^## \[[0-9].*]' CHANGELOG.md)" = "## [$version]"
check "metainfo has $version" grep -q "<release version=\"$version\" " tools/desktop/glint-view.metainfo.xml

stage=$scratch/stage
at_stage() { $make -s BUILD="$build" DESTDIR="$stage" PREFIX=/p BINDIR=/b MANDIR=/m DOCDIR=/d ZSHDIR=/z "$1"; }
check "make install" at_stage install
for file in b/glint m/man1/glint.1 m/man5/glint-scene.5 m/man5/glint-json.5 d/README.md d/docs/guide.md z/_glint p/share/bash-completion/completions/glint \
    p/share/fish/vendor_completions.d/glint.fish p/share/glint/scenes/meshes/bunny.obj; do
    check "$file is installed" test -s "$stage/$file"
done
elsewhere() { find "$stage" -type f -printf '%P\n' | grep -vE '^([bmdz]|p/share/(bash-completion|fish|glint|applications|icons|metainfo))/'; }
check "make install writes nothing elsewhere" test -z "$(elsewhere)"
check "the installed program has its version" grep -q '^glint [0-9]' <("$stage/b/glint" --version)
check "the installed scenes find their files" "$stage/b/glint" check "$stage/p/share/glint/scenes/bunny.yaml"

if [ -e "$build/glint-view" ]; then
    check "the installed glint starts glint-view" diff <("$stage/b/glint" view --help) <("$build/glint-view" view --help)
    check "its manual page" test -s "$stage/m/man1/glint-view.1"
    check "its icon" test -s "$stage/p/share/icons/hicolor/scalable/apps/glint-view.svg"
    desktop=$stage/p/share/applications/glint-view.desktop
    printf '#!/bin/sh\necho "$@"\n' >"$scratch/glint"
    chmod +x "$scratch/glint"
    # desktop_starts FILE: prints what the desktop entry starts for it. Its strings have doubled backslashes.
    desktop_starts() {
        local line file=
        line=$(sed -n 's/^Exec=//p' "$desktop" | sed 's/\\\\/\\/g')
        [ -z "$1" ] || file='"$FILE"'
        FILE=$1 PATH=$scratch:$PATH sh -c "${line/\%f/$file}"
    }
    check "from a menu the window shows the demo" test "$(desktop_starts '')" = 'view /p/share/glint/scenes/demo.yaml'
    check "a file is shown" test "$(desktop_starts 'a $b.yaml')" = 'view a $b.yaml'
    ! command -v desktop-file-validate >/dev/null || check "desktop-file-validate" desktop-file-validate "$desktop"
    ! command -v appstreamcli >/dev/null || check "appstreamcli" metadata_validate "$stage"/p/share/metainfo/*
fi

touch "$stage/d/mine"
check "make uninstall" at_stage uninstall
check "make uninstall leaves only what others put there" test "$(find "$stage" -type f -printf '%P ')" = 'd/mine '
check "make uninstall removes glint's folders" test ! -e "$stage/p/share/glint" -a ! -e "$stage/d/docs"

# Lists the commands of a whole build without running them.
$make -n BUILD="$scratch/none" CC=ccc CPPFLAGS=-DPREPROCESS CFLAGS=-DCOMPILE LDFLAGS=-DLINK all >"$scratch/commands"
compiling=$(grep -c '^ccc.* -c ' "$scratch/commands")
check "each of $compiling commands to compile has CPPFLAGS and CFLAGS" test "$compiling" -gt 100 -a \
    "$(grep -c '^ccc.* -DPREPROCESS -DCOMPILE .*-c ' "$scratch/commands")" = "$compiling"
check "commands to link have CFLAGS and LDFLAGS" grep -q '^ccc.* -DCOMPILE -DLINK .*-o .*/none/glint$' "$scratch/commands"
check "warnings fail no build" test "$($make -n BUILD="$scratch/none" WERROR= all | grep -c -e -Werror)" = 0
check "warnings fail with WERROR=1" test "$($make -n BUILD="$scratch/none" WERROR=1 all | grep -c -e '-Werror .*-c ')" = "$compiling"
check "make mpi install on a clean tree installs glint-mpi" grep -q ' glint-mpi; do install ' <($make -n BUILD="$scratch/none" mpi install)
check "PKG_CONFIG finds libraries" grep -q 'Libraries are missing' <($make -n PKG_CONFIG=false all 2>&1)

# Compiles copies of the source in two folders.
mkdir -p "$scratch/one" "$scratch/two/deeper"
objects='kernel_files.o page_files.o host/base/fault.o host/api/version.o host/image/png.o'
compile() {
    local folder=$1 build=$2
    cp -r Makefile host kernels tools "$folder"
    $make -s -C "$folder" BUILD="$build" $(printf "$build/%s " $objects) CFLAGS="-O1 $3"
}
check "objects in one folder" compile "$scratch/one" build '-g -DMARK_OF_FLAGS'
check "objects in another" compile "$scratch/two/deeper" "$scratch/two/objects" '-g -DMARK_OF_FLAGS'
for object in $objects; do
    check "$object is the same in both" cmp "$scratch/one/build/$object" "$scratch/two/objects/$object"
    check "$object names no folder" test "$(grep -c "$scratch" "$scratch/two/objects/$object")" = 0
done
check "without a clone the version is the Makefile's" grep -qw "$version" "$scratch/one/build/host/api/version.o"
check "objects without debug information" compile "$scratch/one" plain -DMARK_OF_FLAGS
check "CFLAGS are not compiled in" test "$(cd "$scratch/one/plain" && grep -l MARK_OF_FLAGS $objects)" = ''
check "the program names no folder" test "$(grep -cF "$PWD" "$build/glint")" = 0

if commit=$(git rev-parse --verify -q HEAD 2>/dev/null); then
    mkdir "$scratch/archive"
    git archive HEAD | tar -x -C "$scratch/archive"
    check "an archive compiles" $make -s -C "$scratch/archive" BUILD=build build/host/api/version.o
    check "an archive knows its commit" grep -q "$commit" "$scratch/archive/build/host/api/version.o"
fi
finish
