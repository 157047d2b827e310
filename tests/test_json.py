#!/usr/bin/env -S python3 -B
"""Each command's JSON has the members that docs/json.md lists, and no others, of the types it says."""
import itertools
import json
import re
import unittest

from glint import PLANET, ROOT, TestCase, main, need_device, read, write

RARE = {"doubt", "clock_doubt"}  # of a device's clock that is not trusted, which no test can bring about
# Scenes of spheres, one point light and reflection, which share their kernels.
PLAIN = """\
camera: {position: [0, 1, -4], look_at: [0, 0, 0], fov: 60}
lights: [{point: {position: [3, 5, -3]}}]
objects:
  - sphere: {center: [0, 0.5, 0], radius: 0.5, material: {reflection: 0.5}}
  - sphere: {center: [0, -100, 0], radius: 100}
"""
STRONG = PLAIN.replace("[3, 5, -3]", "[3, 5, -3], intensity: 1e30, color: [1e30, 1, 1]")  # beyond float
WARNED = PLAIN + "  - triangle: {vertices: [[0, 0, 0], [1, 1, 1], [2, 2, 2]]}\n"
SMALL = "--size 48x32"
QUICK = "--lanes 1 --seconds 0.1"


def alternatives(name):
    """a.{b,c} stands for a.b and a.c."""
    parts = [part[1:-1].split(",") if part.startswith("{") else [part] for part in re.split(r"(\{[^}]*\})", name)]
    return ["".join(words) for words in itertools.product(*parts)]


def listed_members(heading):
    """From each member's path to the words of its type, and the number of the schema."""
    document = read(ROOT / "docs/json.md")
    section = re.search(rf"^## {re.escape(heading)}\n(.*?)(?=^## |\Z)", document, re.M | re.S).group(1)
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


def is_absent_figure(value):
    return isinstance(value, dict) and set(value) == {"status", "reason"} and value["status"] == "unavailable"


def members_of(value, path=""):
    """Each member's path and value; a path ends in [] where an array holds objects."""
    if isinstance(value, dict) and not (path and is_absent_figure(value)):
        if path:
            yield path, value
        for key, member in value.items():
            yield from members_of(member, f"{path}.{key}" if path else key)
    elif isinstance(value, list) and any(isinstance(element, dict) for element in value):
        for element in value:
            yield from members_of(element, path + "[]")
    elif value != []:
        yield path, value


def is_of_type(value, words):
    """Whether a value is of the type in the second column."""
    if value is None:
        return "null" in words
    if isinstance(value, dict):
        return not is_absent_figure(value) or ("figure" in words and value["reason"] != "")
    if isinstance(value, list):
        return all(is_of_type(element, words) for element in value)
    if isinstance(value, bool) or "boolean" in words:
        return isinstance(value, bool) and "boolean" in words
    if isinstance(value, str):
        return "text" in words or ("hash" in words and bool(re.fullmatch("[0-9a-f]{16}", value)))
    if "number" in words or "figure" in words:
        return True
    return isinstance(value, int) and value >= 0 and bool(re.search("count|integer", words))


class Json(TestCase):
    def setUp(self):
        super().setUp()
        write("plain.yaml", PLAIN)
        write("strong.yaml", STRONG)

    def check_members(self, heading, *reports):
        """The reports together print every member that is listed under the heading."""
        listed, schema = listed_members(heading)
        self.assertEqual({report["schema"] for report in reports}, {schema})
        printed = [member for report in reports for member in members_of(report)]
        self.assertEqual({path for path, _ in printed} - set(listed), set(), "printed, not listed")
        missing = set(listed) - {path for path, _ in printed}
        self.assertEqual({path for path in missing if path.split(".")[-1] not in RARE}, set(), "listed, not printed")
        for path, value in printed:
            self.assertTrue(not listed[path] or is_of_type(value, listed[path]), f"{path} is {value!r}, not {listed[path]}")

    def test_render(self):
        self.check_members("glint render --timing=json", self.json(
            f"render plain.yaml {SMALL} --lanes 1 --aov t,path --timing=json"))

    def test_check(self):
        write("warned.yaml", WARNED)
        write("broken.yaml", "objects: [{ball: {}}]\n")
        self.check_members("glint check", self.json("check plain.yaml --json"), self.json("check warned.yaml --json"),
                           self.json("check broken.yaml --json", status=1))

    def test_devices(self):
        self.check_members("glint devices", self.json("devices --json"))

    def test_diff(self):
        self.glint(f"render plain.yaml {SMALL} --lanes 1 --aov t -o a.png")
        self.glint(f"render plain.yaml {SMALL} --lanes 1 --bounces 0 -o b.png")
        self.check_members("glint diff", self.json("diff a.png b.png --heatmap map.png --json", status=3),
                           self.json("diff a.t.npy a.t.npy --json"))

    def test_bench(self):
        bench = self.glint(f"bench plain.yaml strong.yaml {SMALL} {QUICK} --bvh auto,on --launches --json")
        write("bench.json", bench.stdout)
        self.check_members("glint bench", self.json(
            f"bench plain.yaml {SMALL} {QUICK} --bvh off,on --json --compare bench.json --tolerance 1e6"),
            json.loads(bench.stdout))

    def test_verify(self):
        """Cases with a measure and without, one of them an image."""
        self.check_members("glint verify", self.json("verify S5 P4 P6 --precision single --lanes 1 --lean --json"),
                           self.json("verify P4 --precision single --lanes 1 --lean --json --perturb 1"))

    @unittest.skipUnless(need_device()["fp64"], "the device has no 64-bit floating point for a reference")
    def test_accuracy(self):
        write("planet.yaml", PLANET)
        mirrors = ROOT / "tests/scenes/mirror-balls.yaml"  # at single, paths are wrong
        common = f"--size 96x64 {QUICK} --bounces 16 --json"
        self.check_members(
            "glint accuracy",
            self.json(f"accuracy planet.yaml {mirrors} strong.yaml {common} --precision single,double --perturb 1 "
                      "--save saved"),
            self.json(f"accuracy plain.yaml {common} --precision double"),
            self.json(f"accuracy planet.yaml {common} --precision single --reference saved/0-planet-reference.color.npy"))


if __name__ == "__main__":
    main()
