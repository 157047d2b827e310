#!/usr/bin/env -S python3 -B
"""Writes the scenes of tests/broken/FORMAT.txt as files, which fuzzers begin with: tests/broken_scenes.py FORMAT FOLDER"""
import re
import sys
from pathlib import Path


def scenes(ending):
    """Yields the name and the bytes of each scene."""
    table = Path(__file__).with_name("broken") / f"{ending}.txt"
    start, *sections = re.split(r"(?m)^#### scene ", table.read_text(encoding="utf-8"))
    for section in sections:
        name, body = section.split("\n", 1)
        text, end, _ = re.split(r"(?m)^#### expected(.*)\n", body.replace("#### start\n", start))
        text = re.sub(r"(?m)^#### repeat (\d+) (\d+) (.*\n)",
                      lambda run: "".join(run[3].replace("%d", str(i)) for i in range(int(run[1]), int(run[2]) + 1)), text)
        content = re.sub("(?m)^#### set .*\n", "", text).encode()
        if content.startswith(b"#### escaped\n"):
            content = re.sub(rb"\\x(..)", lambda byte: bytes.fromhex(byte[1].decode()), content.split(b"\n", 1)[1])
        yield f"{name}.{ending}", content[:-1] if end else content


def write(ending, folder):
    """Writes the scenes as files and returns their paths."""
    paths = [Path(folder, name) for name, _ in scenes(ending)]
    for path, (_, content) in zip(paths, scenes(ending)):
        path.write_bytes(content)
    return paths


if __name__ == "__main__":
    write(*sys.argv[1:])
