#!/bin/bash
# The code that docs/adding-a-shape.md shows is the sources': each of its blocks, spaces aside, stands in one of the files
# named before it (a declaration stands there with its body), and every file it names is there.
. "$(dirname "$0")/support.bash"

command -v python3 >/dev/null || skip_all "there is no python3"

cat >"$scratch/blocks.py" <<'END'
import re, sys
text = open("docs/adding-a-shape.md").read()
dense = lambda code: re.sub(r"\s+", "", code)
names = re.findall(r"`((?:host|kernels|tests|tools|docs|scenes)/[\w./-]+)`", text)
folder, wrong, count = "", 0, 0
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
    named = re.findall(r"`((?:host|kernels)/[\w/]+\.[ch])`", text[:match.start()])
    # `flatten.c` after `host/compile/features.c` is in the same folder
    beside = [f"{named[-1].rsplit('/', 1)[0]}/{name}" for name in re.findall(r"`(\w+\.[ch])`", text[:match.start()])]
    sources = []
    for name in reversed(named + beside):
        try:
            sources.append(dense(open(name).read()))
        except OSError:
            pass
    lines = match[1].splitlines()
    whole = dense(match[1])
    parts = [whole] if any(whole in source for source in sources) else [dense(line).removesuffix(";") for line in lines]
    for part in parts:
        if part and not any(part in source for source in sources):
            print("not in the sources:", part)
            wrong += 1
print(count, "blocks")
sys.exit(wrong > 0 or count < 4)
END
check "docs/adding-a-shape.md shows the sources" python3 "$scratch/blocks.py"
finish
