"""The members of a command's JSON against those that docs/json.md lists, both ways, and their types.

usage: json_members.py HEADING REPORT.json...

HEADING is the document's, such as "glint bench". The reports together must print every member listed, but for those that
no test can bring about: what is said of a device's clock that is not trusted.
"""

import itertools
import json
import re
import sys

RARE = {"doubt", "clock_doubt"}


def alternatives(name):
    """a.{b,c} stands for a.b and a.c."""
    parts = [part[1:-1].split(",") if part.startswith("{") else [part] for part in re.split(r"(\{[^}]*\})", name)]
    return ["".join(words) for words in itertools.product(*parts)]


def listed(heading):
    """From each member's path to its type's words, and the number of the schema."""
    with open("docs/json.md", encoding="utf-8") as document:
        section = re.search(rf"^## {re.escape(heading)}\n(.*?)(?=^## |\Z)", document.read(), re.M | re.S).group(1)
    members, schema, prefix = {}, None, ""
    for line in section.splitlines():
        if line.startswith("### "):
            prefix = re.search(r"`(.*)`", line).group(1) + "."
        if not line.startswith("| `"):
            continue
        names, words, meaning = (cell.strip() for cell in line.strip("|").split("|"))
        names = re.findall(r"`([^`]*)`", names)
        for name in names:
            for path in alternatives(names[0] + name if name.startswith(".") else name):
                assert prefix + path not in members, f"{prefix + path} is listed twice"
                members[prefix + path] = words
        if names == ["schema"]:
            schema = int(meaning)
    return members, schema


def is_figure_absent(value):
    return set(value) == {"status", "reason"} and value["status"] == "unavailable" and bool(value["reason"])


def members_of(value, path=""):
    """Each member's path and value; a path ends in [] where an array holds objects."""
    if isinstance(value, dict) and not (path and is_figure_absent(value)):
        if path:
            yield path, value
        for key, member in value.items():
            yield from members_of(member, f"{path}.{key}" if path and not path.endswith(".") else path + key)
    elif isinstance(value, list) and any(isinstance(element, dict) for element in value):
        for element in value:
            yield from members_of(element, path + "[]")
    elif value != []:
        yield path, value


def is_of_type(value, words):
    """Whether a value that holds no members is what the second column says."""
    if value is None:
        return "null" in words
    if isinstance(value, dict):
        return is_figure_absent(value) and "figure" in words
    if isinstance(value, list):
        return all(is_of_type(element, words) for element in value)
    if isinstance(value, bool) or "boolean" in words:
        return isinstance(value, bool) and "boolean" in words
    if isinstance(value, str):
        return "text" in words or ("hash" in words and bool(re.fullmatch("[0-9a-f]{16}", value)))
    if isinstance(value, int):
        return "number" in words or "figure" in words or (bool(re.search("count|integer", words)) and value >= 0)
    return "number" in words or "figure" in words


def main():
    heading, *paths = sys.argv[1:]
    members, schema = listed(heading)
    printed, faults = set(), set()
    for path in paths:
        with open(path, encoding="utf-8") as file:
            report = json.load(file)
        if report["schema"] != schema:
            faults.add(f"schema {report['schema']}, listed is {schema}")
        for member, value in members_of(report):
            printed.add(member)
            if member not in members:
                faults.add(f"printed, not listed: {member}")
            elif members[member] and not isinstance(value, dict) and not is_of_type(value, members[member]):
                faults.add(f"{member} is {value!r}, listed as {members[member]}")
            elif isinstance(value, dict) and is_figure_absent(value) and not is_of_type(value, members[member]):
                faults.add(f"{member} is unavailable, listed as {members[member]}")
    for member in set(members) - printed:
        if member.split(".")[-1] not in RARE:
            faults.add(f"listed, not printed: {member}")
    print("\n".join(sorted(faults)))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
