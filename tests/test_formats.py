#!/usr/bin/env -S python3 -B
"""Reads reports in the formats of other programs by the reader of each format. They must agree with --json. Sanitizers see the
same writers in test_json.

run_tests: sanitize-long-only"""
import csv
import importlib.util
import io
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import time
import unittest
import xml.etree.ElementTree as ElementTree

from glint import SPHERE, TestCase, main, need_device, read, write

SMALL = "--size 32x24"
HAS_DOUBLE = need_device()["fp64"]
# Command, options, the members with its rows, the headings that name a row, and members by their headings.
COMMANDS = {
    "bench": (f"bench s.yaml {SMALL} --seconds 0.05 --no-build-times --samples 1,2", ["runs"], 8,
              {"precision": ("precision",), "samples": ("samples",), "frame ms": ("frame_ms", "median"), "runs": ("frame_ms", "runs")}),
    "devices": ("devices", ["devices"], 1,
                {"device": ("index",), "name": ("name",), "default": ("default",), "exact div": ("correctly_rounded_divide_sqrt",)}),
    "verify": ("verify S1 P4 --precision single", ["precisions", "cases"], 3,
               {"case": ("name",), "passed": ("passed",), "rays": ("rays",), "worst": ("worst",)}),
}
if HAS_DOUBLE:
    COMMANDS["accuracy"] = (f"accuracy s.yaml {SMALL} --seconds 0.05 --precision single,double", ["scenes", "variants"], 6,
                            {"precision": ("precision",), "wrong objects away": ("errors", "object", "away"), "crossed out": ("crossed_out",)})
    COMMANDS["certify"] = (f"certify s.yaml {SMALL} --pixels 100 --precision single,certified", ["precisions"], 3,
                           {"precision": ("precision",), "pixels": ("compared",), "verdict": ("claim",)})


def rows_of(document, path):
    rows = [document]
    for member in path:
        rows = [inner for row in rows for inner in row[member]]
    return rows


def member(row, path):
    for name in path:
        row = row.get(name) if isinstance(row, dict) else None
    return row


def text(value):
    return "" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


class Formats(TestCase):
    reports = {}  # in JSON, by command

    files = {"s.yaml": SPHERE}

    def rows(self, command, path):
        """Returns the rows of the report in JSON, by one run for all formats, since a bench builds its kernels on every run."""
        if command not in self.reports:
            self.reports[command] = self.json(f"{command} --json")
        return rows_of(self.reports[command], path)

    def written(self, command, form):
        """Returns the report in a format, by --output."""
        self.glint(f"{command} --format {form} --output report")
        return read("report")

    def agrees(self, cells, row, members):
        """Checks the cells of a row. Columns of measured times may differ from run to run, others are the document's."""
        for heading, path in members.items():
            value = member(row, path)
            if isinstance(value, float) and path[0] == "frame_ms":
                self.assertGreater(float(cells[heading]), 0)
            elif path[-1] != "runs":
                self.assertEqual(cells[heading], text(value), heading)

    def test_csv(self):
        for name, (command, path, _, members) in COMMANDS.items():
            with self.subTest(name):
                rows = self.rows(command, path)
                found = list(csv.DictReader(io.StringIO(self.written(command, "csv"))))
                self.assertEqual(len(found), len(rows))
                for cells, row in zip(found, rows):
                    self.agrees(cells, row, members)

    def test_markdown(self):
        for name, (command, path, _, members) in COMMANDS.items():
            with self.subTest(name):
                rows = self.rows(command, path)
                head, rule, *lines = self.glint(f"{command} --format markdown").stdout.splitlines()
                self.assertEqual(len(lines), len(rows))
                self.assertRegex(rule, r"^\| ---( \| ---)* \|$")
                self.assertEqual({line.count(" | ") for line in (head, *lines)}, {head.count(" | ")})
                self.assertTrue(set(members) <= set(head.strip("| ").split(" | ")))

    def test_junit(self):
        for name, (command, path, named, _) in COMMANDS.items():
            with self.subTest(name):
                rows = self.rows(command, path)
                (suite,) = ElementTree.fromstring(self.written(command, "junit"))
                self.assertEqual((suite.get("name"), suite.get("tests"), suite.get("failures")), (f"glint {name}", str(len(rows)), "0"))
                self.assertEqual([case.get("classname") for case in suite], [f"glint.{name}"] * len(rows))
                self.assertEqual(len({case.get("name") for case in suite}), len(rows), "names are unique")
        failing = self.glint("verify S1 P4 --precision single --perturb 1:1000 --format junit", status=3).stdout
        (suite,) = ElementTree.fromstring(failing)
        self.assertEqual((suite.get("tests"), suite.get("failures")), ("2", "1"))
        (failure,) = suite.iter("failure")
        self.assertRegex(failure.get("message"), "passed false, rays 36, wrong [1-9]")

    def test_junit_of_what_differs_or_is_missing(self):
        for size in "8x6", "9x6":
            self.glint(f"render s.yaml --size {size} -o {size}.npy --quiet")
        self.glint("render s.yaml --size 8x6 --bounces 0 --samples 4 -o '8\"<&>.npy' --quiet")
        (suite,) = ElementTree.fromstring(self.glint("diff 8x6.npy '8\"<&>.npy' --format junit", status=3).stdout)
        self.assertEqual([case.get("name") for case in suite], ['8x6.npy 8"<&>.npy'])
        self.assertRegex(next(suite.iter("failure")).get("message"), "equal false, differing values [1-9]")
        (suite,) = ElementTree.fromstring(self.glint("diff 8x6.npy '8\"<&>.npy' --max-rmse 1 --format junit").stdout)
        self.assertEqual(list(suite.iter("failure")), [])
        if HAS_DOUBLE:
            write("strong.yaml", SPHERE.replace("[3, 4, -5]", "[3, 4, -5], intensity: 1e30, color: [1e30, 1, 1]"))
            (suite,) = ElementTree.fromstring(self.glint(f"certify strong.yaml {SMALL} --pixels 20 --format junit").stdout)
            for row in suite.iter("skipped"):
                self.skip_if_refused(row.get("message", ""))
            self.assertEqual((suite.get("tests"), suite.get("skipped")), ("4", "3"))

    def test_benchmark(self):
        """Repetitions are as google/benchmark writes them. Names, times and their unit are what its tools read."""
        start = time.monotonic()
        out = self.glint(f"{COMMANDS['bench'][0]} --format benchmark --output report.json").stdout
        elapsed_us = 1e6 * (time.monotonic() - start)
        report = json.loads(read("report.json"))
        self.assertLess(sum(entry["real_time"] for entry in report["benchmarks"]), elapsed_us)
        slowest_ms = [float(ms) for ms in re.findall(r"^ +[12] +[\d.]+ +[\d.]+ +([\d.]+) ", out, re.M)]
        self.assertEqual(report["context"]["executable"], "glint")
        names = {entry["name"] for entry in report["benchmarks"]}
        self.assertEqual({name.split("/")[0] for name in names}, {"s.yaml"})
        self.assertEqual((len(names), len(slowest_ms)), (2, 2))
        slowest_us = max(entry["real_time"] for entry in report["benchmarks"])
        self.assertTrue(math.isclose(slowest_us, 1000 * max(slowest_ms), rel_tol=0.01, abs_tol=6))
        for name in names:
            entries = [entry for entry in report["benchmarks"] if entry["name"] == name]
            self.assertEqual([entry["repetition_index"] for entry in entries], list(range(entries[0]["repetitions"])))
            for entry in entries:
                self.assertEqual((entry["run_type"], entry["time_unit"], entry["run_name"]), ("iteration", "us", name))
                self.assertGreater(entry["real_time"], 0)

    def test_benchmark_compare(self):
        """google/benchmark's compare.py, of Debian's libbenchmark-tools, compares two runs."""
        compare = "/usr/share/benchmark/compare.py"
        if not os.path.exists(compare) or not importlib.util.find_spec("scipy"):
            self.skipTest("libbenchmark-tools or python3-scipy is not installed")
        for name in "a.json", "b.json":
            self.glint(f"{COMMANDS['bench'][0]} --format benchmark --output {name}")
        out = subprocess.run([sys.executable, compare, "--no-color", "benchmarks", "a.json", "b.json"], check=True, capture_output=True, text=True).stdout
        self.assertEqual(len(re.findall(r"^s\.yaml/.*_pvalue .* U Test", out, re.M)), 2)

    def test_output(self):
        """The text stays on standard output, and the file's ending gives the format. A wrong call writes nothing."""
        out = self.glint("verify S1 --precision single --output report.xml").stdout
        self.assertIn("tier B: 1 of 1 case passed", out)
        ElementTree.fromstring(read("report.xml"))
        self.glint("verify S1 --precision single --output report.json")
        self.assertEqual(json.loads(read("report.json"))["schema"], 3)
        self.refuses("verify S1 --output report.txt", "the file's ending gives no format")
        for options in "", "--json", "--format csv":
            self.refuses(f"verify S1 --output - {options}", "--output: expected the name of a file")
        for path in "text.json", "text.txt":
            self.refuses(f"verify S1 --format text --output {path}", "--format text cannot be combined with --output")
        self.refuses("verify S1 --format benchmark", "--format: expected text, json, csv, markdown or junit")
        self.refuses("verify S1 --format jnuit", "--format: .*did you mean junit")
        self.refuses("verify S1 --precision single --output nowhere/report.xml", "nowhere/report.xml")
        self.assertEqual([*pathlib.Path().glob("report.txt*"), *pathlib.Path().glob("text*")], [])


if __name__ == "__main__":
    main()
