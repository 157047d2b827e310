#!/bin/bash
# Checks that tools/lint-words finds each pattern in prose and comments, at its line, and nothing in code.
. "$(dirname "$0")/support.bash"

command -v python3 >/dev/null || skip_all "there is no python3"

# found FILE LINES: checks that these are the lines with findings.
found() {
    check "$1: lines $2" test "$(tools/lint-words "$scratch/$1" | sed -E 's/^[^:]*:([0-9]+):.*/\1/' | sort -nu | xargs)" = "$2"
}
cat >"$scratch/page.md" <<'END'
Of all images one is empty.

There is no image. A disc is no sphere.
It is rendered anew, beside the
file; it goes on. `beside` is code,

    and so is anew.

| a cell | Of two, which is a cell |
- A ray hits the sphere,
  too. A light of its own is in doubt.
END
found page.md '1 3 4 5 11'
cat >"$scratch/source.c" <<'END'
// Of each ray, the hit.
const char *anew = "beside//anew";
int mend; // the article
/* A room that has no
   room for it. */
// Returns the hit, and the next one, too.
// This continues.
fail("a ray meets %d shapes", "beside");
END
found source.c '1 3 4 6 8'
printf '#!/usr/bin/env python3\n"""Renders anew."""\nbeside = "anew"  # goes on\nprint(f"beside\\n", f"is {1} beside\\n")\n' >"$scratch/tool.py"
found tool.py '2 3 4'
printf '#!/bin/sh\necho anew "$#" # beside\n' >"$scratch/tool"
found tool 2
printf '.TH GLINT 1\n.B anew\ngoes on\n' >"$scratch/page.1"
found page.1 '2 3'
tools/lint-words "$scratch/page.md" >"$scratch/out"
check "findings give exit status 1" [ $? = 1 ]
printf 'The image is empty.\n' >"$scratch/clean.md"
check "a clean page gives exit status 0" tools/lint-words "$scratch/clean.md"
finish
