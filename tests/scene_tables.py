#!/usr/bin/env -S python3 -B
r"""Reads tables of scenes: tests/broken/FORMAT.txt and tests/wild.txt.

A section is a scene and the messages that it must get, each as `line:column: severity: text`:

    #### start
    text…                              the lines with which all scenes up to the next start begin
    #### scene NAME
    #### set PATH=VALUE                an override; any number of them
    #### s/PATTERN/REPLACEMENT/        replaces each match of a regular expression in the text so far
    text…                              \xNN stands for a byte
    #### repeat FIRST LAST line        a line or message per number, with the number for each %d
    #### no newline                    removes the end of the last line
    messages…

`tests/scene_tables.py TABLE FOLDER` writes the scenes of a table as files, which fuzzers begin with."""
import re
import sys
from collections import namedtuple
from pathlib import Path

Scene = namedtuple("Scene", "name overrides content messages")
MESSAGE = re.compile(r"(--set:)?(\d+:\d+: )?(error|warning): ")


def scenes(table):
    """Yields the scenes of a table."""
    text = re.sub(rb"\\x(..)", lambda byte: bytes.fromhex(byte[1].decode()), Path(table).read_bytes())
    for section in text.decode(errors="surrogateescape").split("#### start\n"):
        start, *parts = re.split("(?m)^#### scene ", section)
        for part in parts:
            name, body = part.split("\n", 1)
            body = re.sub(r"(?m)^#### repeat (\d+) (\d+) (.*\n)", lines_of, body)
            yield scene_of(name, start, re.findall(".*\n", body))


def lines_of(repeat):
    first, last, line = repeat.groups()
    return "".join(line.replace("%d", str(i)) for i in range(int(first), int(last) + 1))


def scene_of(name, content, lines):
    overrides, messages = [], []
    for line in lines:
        if found := re.fullmatch("#### set (.*)\n", line):
            overrides.append(found[1])
        elif found := re.fullmatch("#### s/([^/]*)/([^/]*)/\n", line):
            content, count = re.subn(found[1], found[2], content, flags=re.MULTILINE)
            assert count > 0, f"{name}: {line}"
        elif line == "#### no newline\n":
            content = content[:-1]
        elif MESSAGE.match(line):
            messages.append(line[:-1])
        else:
            content += line
    return Scene(name, overrides, content.encode(errors="surrogateescape"), messages)


def messages_in(errors):
    """Returns all messages that the program printed, without the lines that they quote."""
    return re.findall("(?m)^\\S+: (?:error|warning): .*", errors)


def messages_about(file, scene):
    """Returns the messages that the scene must get from this file, as the program prints them."""
    return [message if message.startswith("--set:") else f"{file}:{'' if message[0].isdigit() else ' '}{message}" for message in scene.messages]


def write(table, folder):
    """Writes the scenes as files whose names end as the table's does before .txt."""
    for scene in scenes(table):
        Path(folder, f"{scene.name}.{Path(table).stem}").write_bytes(scene.content)


if __name__ == "__main__":
    write(*sys.argv[1:])
