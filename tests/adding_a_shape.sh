#!/bin/bash
# Checks that the code that docs/adding-a-shape.md shows is that of the sources. Each of its blocks, spaces aside, must be in a
# file named before it, and every file it names must exist.
. "$(dirname "$0")/support.bash"

command -v python3 >/dev/null || skip_all "there is no python3"

cat >"$scratch/blocks.py" <<'END'
import re, sys
text = open("docs/adding-a-shape.md").read()
dense = lambda code: re.sub(r"\s+", "", code)
names = re.findall(r"`((?:host|kernels|tests|tools|docs|scenes)/[\w./-]+)`", text)
wrong, count = 0, 0
for name in names:
    try:
        open(name).close()
    except IsADirectoryError:
        pass
    except OSError as fault:
        print(fault)
        wrong += 1
for match in re.finditer(r"```c\n(.*?)```", text, re.DOTALL):
    count += 1
    sources = re.findall(r"`((?:host|kernels)/[\w/]+\.[ch])`", text[:match.start()])
    if not any(dense(match[1]) in dense(open(name).read()) for name in sources):
        print("not in the sources:", match[1])
        wrong += 1
print(count, "blocks")
sys.exit(wrong > 0 or count < 1)
END
check "docs/adding-a-shape.md shows the sources" python3 "$scratch/blocks.py"
finish
