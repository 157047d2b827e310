#!/usr/bin/env -S python3 -B
"""Checks that docs/glint-json.5 and docs/glint.schema.json are what tests/json_reference.py makes of each command's JSON, whose
members must be of the types that it states.

--write writes both.

run_tests: sanitize-long-only"""
import copy
import importlib.util
import json
import os
import re
import sys
import unittest

import json_reference
from glint import BALLS, PROGRAM, ROOT, TestCase, main, need_device, preloaded, read, run, shim_build, write

WRITES = "--write" in sys.argv
RARE = {"fault", "clock_fault"}  # of a device's clock that is not trusted, which no test can bring about
# Scenes of spheres, one point light and reflection, which share their kernels.
PLAIN = """\
camera: {position: [0, 1, -4], look_at: [0, 0, 0], fov: 60}
lights: [{point: {position: [3, 5, -3]}}]
objects:
  - sphere: {center: [0, 0.5, 0], radius: 0.5, material: {reflection: 0.5}}
  - sphere: {center: [0, -3, 0], radius: 3}
"""
STRONG = PLAIN.replace("[3, 5, -3]", "[3, 5, -3], intensity: 1e30, color: [1e30, 1, 1]")  # beyond float
WARNED = PLAIN + "  - triangle: {vertices: [[0, 0, 0], [1, 1, 1], [2, 2, 2]]}\n"
SMALL = "--size 48x32"
QUICK = "--seconds 0.1"


PAGE = ROOT / "docs/glint-json.5"
SECTIONS = {}
SCHEMA_FILE = ROOT / "docs/glint.schema.json"
SCHEMAS = {}
HAS_SCHEMAS = importlib.util.find_spec("jsonschema") is not None


def is_absent_figure(value):
    return isinstance(value, dict) and set(value) == {"status", "reason"} and value["status"] == "unavailable"


def members_of(value, path=""):
    """Yields each member's path and value. A path ends in [] where an array holds objects."""
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
    """Returns whether a value is of the type."""
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


def in_order(paths):
    """Returns the paths in an order in which a member's members follow it."""
    ordered = []
    for path in paths:
        family = [i for i, other in enumerate(ordered) if other == path.rpartition(".")[0] or
                  other.startswith(path.rpartition(".")[0] + ".")]
        ordered.insert(family[-1] + 1 if family else len(ordered), path)
    return ordered


class Json(TestCase):
    files = {"plain.yaml": PLAIN, "strong.yaml": STRONG}

    def check_members(self, heading, *reports):
        """Checks that the reports together print the members of the page's section, each of its type."""
        schema, = {report["schema"] for report in reports}
        printed = [member for report in reports for member in members_of(report)]
        paths = list(dict.fromkeys(path for path, _ in printed if path.split(".")[-1] not in RARE))
        for path, value in printed:
            meaning = json_reference.meaning_of(path)
            self.assertIsNotNone(meaning, f"{path} has no meaning")
            self.assertTrue(is_of_type(value, meaning[1]), f"{path} is {value!r}, not {meaning[1]}")
        SECTIONS[heading] = json_reference.section(heading, schema, in_order(paths))
        SCHEMAS[heading] = json_reference.schema_of(reports)
        if not WRITES:
            self.assertIn(SECTIONS[heading], read(PAGE))
            for report in reports if HAS_SCHEMAS else ():
                validator_of(heading).validate(report)

    def test_render(self):
        fp64 = need_device()["fp64"]
        budget = "--max-error 0.5 " if fp64 else ""
        outputs = [self.json(f"render plain.yaml {SMALL} {budget}--aov t,path --timing=json"),
                   self.json(f"render plain.yaml {SMALL} --frames 1 --timing=json")]
        if fp64:
            outputs.append(self.json(f"render plain.yaml {SMALL} --precision certified --timing=json"))
        for device in [device for output in outputs for device in output["by_device"]]:
            self.check_launches(device["launches"], device["read_backs"])
            self.assertIn("-cl-std=CL1.2", device["build_options"])
        self.check_members("glint render --timing=json", *outputs)

    def check_launches(self, launches, reads):
        """Checks that moments begin with the first command's queueing and are in order, and that groups fill the work-items."""
        for launch in launches:
            self.assertEqual(len(launch["local"]), len(launch["global"]))
            self.assertTrue(all(items > 0 and items % group == 0 for items, group in zip(launch["global"], launch["local"])))
        trusted = [command for command in launches + reads if "fault" not in command]
        names = "queued_ms", "submitted_ms", "start_ms", "end_ms"
        moments = [[command[name] for name in names if command[name] is not None] for command in trusted]
        self.assertEqual([sorted(times) for times in moments], moments)
        for command in trusted:
            self.assertAlmostEqual(command["end_ms"] - command["start_ms"], command["event_ms"], delta=1e-4)
        if len(trusted) == len(launches + reads):
            self.assertEqual(min(times[0] for times in moments), 0)

    def test_check(self):
        write("warned.yaml", WARNED)
        write("broken.yaml", "objects: [{ball: {}}]\n")
        self.check_members("glint check", self.json("check plain.yaml --json"), self.json("check warned.yaml --json"),
                           self.json("check broken.yaml --json", status=1))

    def test_devices(self):
        self.check_members("glint devices", self.json("devices --probe --json"))

    def test_diff(self):
        self.glint(f"render plain.yaml {SMALL} --aov t -o a.png")
        self.glint(f"render plain.yaml {SMALL} --bounces 0 -o b.png")
        self.check_members("glint diff", self.json("diff a.png b.png --heatmap map.png --json", status=3),
                           self.json("diff a.png a.png --max-rmse 0 --max-flip 0 --max-off 0 --json"),
                           self.json("diff a.t.npy a.t.npy --max-ulp 0 --json"))

    def compared(self, command):
        """Returns the report of a comparison. Its verdict, and so the exit status, depends on how noisy the machine is."""
        process = run(command)
        self.assertIn(process.returncode, (0, 3, 4), process.stderr)
        return json.loads(process.stdout)

    def test_bench(self):
        fp64 = need_device()["fp64"]
        bench = self.glint(f"bench plain.yaml strong.yaml {SMALL} {QUICK} --samples 1,2 --launches --json")
        baseline = json.loads(bench.stdout)
        for run in baseline["runs"]:
            if "status" not in run:
                self.assertIn("-cl-std=CL1.2", run["build_options"])
                self.assertTrue(all(launch["local"] for launch in run["launches"]))
        for run in baseline["runs"]:
            run["frame_samples_ms"] = run.get("frame_samples_ms", [])[:5]  # too few
        write("bench.json", json.dumps(baseline))
        rest = f"{SMALL} {QUICK} --no-build-times --json"
        # at single a number of strong.yaml is beyond the range
        strong = [self.json(f"bench strong.yaml {rest} --variant '' --variant '--precision double'")] if fp64 else []
        metered = preloaded(shim_build("rapl.so", read(ROOT / "tests/shims/rapl.c")))
        self.check_members("glint bench", self.compared(f"bench plain.yaml {rest} --samples 2,3 --compare bench.json"),
            self.json(f"bench plain.yaml {rest} --samples 2", env=metered),
            json.loads(bench.stdout),
            self.json(f"bench plain.yaml {rest} --samples 2 --variant '' --variant '--work-group 4x4'"),
            self.json(f"bench plain.yaml {rest} --samples 2 --variant '--build-options -DUNUSED=1'"), *strong)
        self.check_members("glint bench --against", self.compared(f"bench plain.yaml {rest} --against {PROGRAM}"))

    def test_certify(self):
        self.check_members("glint certify", self.json(f"certify plain.yaml {SMALL} --precision single,certified --json"),
                           self.json(f"certify plain.yaml {SMALL} --precision single --json --perturb 1:1000"))

    def test_golden(self):
        self.glint(f"golden write plain.yaml {SMALL}")
        same = self.json("golden check --json")
        write("plain.yaml", PLAIN.replace("radius: 0.5", "radius: 0.25"))
        self.check_members("glint golden check", same, self.json("golden check --json", status=3))
        write("plain.yaml", PLAIN)

    def test_verify(self):
        """Cases have a measure or none, and one of them is an image."""
        self.check_members("glint verify", self.json("verify S5 P4 P6 --precision single --json"),
                           self.json("verify P4 --precision single --json --perturb 7"))

    @unittest.skipUnless(HAS_SCHEMAS, "python3-jsonschema is not installed")
    def test_schema_finds_faults(self):
        report = self.json("verify P4 --precision single --json")
        heading = "glint verify"
        case = "precisions", 0, "cases", 0
        for place, value in [(("glint",), None), (("reference_bits",), "113"), (("device",), []), (("precisions",), {}),
                             ((*case, "passed"), 1), ((*case, "rays"), -1), ((*case, "rays"), 1.5), ((*case, "hash"), "12"),
                             ((*case, "unheard_of"), 1), ((*case, "name"), ...)]:
            with self.subTest(place=place, value=value):
                changed = copy.deepcopy(report)
                parent = changed
                for step in place[:-1]:
                    parent = parent[step]
                if value is ...:
                    del parent[place[-1]]
                else:
                    parent[place[-1]] = value
                self.assertFalse(validator_of(heading).is_valid(changed))
        self.assertTrue(validator_of(heading).is_valid(report))

    @unittest.skipUnless(need_device()["fp64"], "the device has no 64-bit floating point for a reference")
    def test_accuracy(self):
        # which of two is nearer is lost at single
        write("twins.yaml", PLAIN + "  - sphere: {center: [1e-9, 0.5, 0], radius: 0.5}\n")
        common = f"--size 96x64 {QUICK} --bounces 16 --json"
        self.check_members(
            "glint accuracy",
            self.json(f"accuracy plain.yaml {BALLS} strong.yaml {common} --precision single,double --save saved"),
            self.json(f"accuracy twins.yaml {common} --precision single --perturb 1:1000"),
            self.json(f"accuracy {BALLS} {common} --precision single --perturb 1:1000 --reference saved/1-mirror-balls-reference.color.npy"))


def validator_of(heading):
    """Returns a validator by the schema, which here allows only its members and rare ones."""
    import jsonschema
    only = {"patternProperties": {f"^({'|'.join(RARE)})$": {"type": "string"}}, "additionalProperties": False}
    schema = json.loads(read(SCHEMA_FILE), object_hook=lambda part: {**part, **only} if "required" in part else part)
    return jsonschema.Draft202012Validator({**schema, "$ref": f"#/$defs/{heading.replace(' ', '%20')}"})


def write_page():
    PAGE.write_text("".join([json_reference.INTRODUCTION, *(SECTIONS[heading] for heading in json_reference.NOTES), json_reference.TAIL]))
    definitions = {"unavailable": json_reference.UNAVAILABLE, **{heading: SCHEMAS[heading] for heading in json_reference.NOTES}}
    lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(schema)}" for name, schema in definitions.items())
    SCHEMA_FILE.write_text('{"$schema": "https://json-schema.org/draft/2020-12/schema",\n'
                           f'"title": "The JSON that glint prints, by command",\n"$defs": {{\n{lines}}}}}\n')


if __name__ == "__main__":
    if WRITES:
        sys.argv.remove("--write")
        unittest.addModuleCleanup(write_page)
    main()
