#!/usr/bin/env -S python3 -B
"""Checks that sentences of the documents that repeat a measured number agree with docs/measurements, at the digits that they
give.

The tables between <!-- measured --> are tested by tests/report.sh. Also checks docs/scene-format.md against what glint reads.
"""
import contextlib
import importlib.util
import io
import json
import os
import re
import statistics
import unittest
from functools import cache
from importlib.machinery import SourceFileLoader

from glint import ROOT, SPHERE, TestCase, has_device, main, read, write


@cache
def measured(name):
    return json.loads(read(ROOT / f"docs/measurements/{name}.json"))


@cache
def text(document):
    """Returns the document on one line, so that a sentence is found wherever it wraps."""
    return " ".join(read(ROOT / document).split())


def agrees(words, value):
    """Returns whether a number as a document gives it is the value rounded to its digits, or whether texts are equal."""
    if isinstance(value, str):
        return words == value
    mantissa, _, exponent = words.replace(",", "").partition("e")
    unit = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    return abs(float(f"{mantissa}e{exponent or 0}") - value) <= 0.5 * unit * (1 + 1e-9)


# Other programs

def frame(scene, program="glint single"):
    return next(rung["programs"][program]["frame_ms"]["median"] for rung in measured("bench-peers")["rungs"]
                if rung["scene"] == scene)


def peer_cases(program):
    """Returns the numbers of passed and of all cases, and the names of those that failed."""
    asked = {case["case"]: case["programs"][program]["passed"] for case in measured("hard-cases-peers")["cases"]
             if case["programs"].get(program, {}).get("asked")}
    return sum(asked.values()), len(asked), sorted(name for name, passed in asked.items() if not passed)


def leaks(program, name):
    why = next(case["programs"][program]["why"] for case in measured("hard-cases-peers")["cases"] if case["case"] == name)
    return tuple(map(int, re.fullmatch(r"leaks (\d+) of (\d+)", why).groups()))


def glint_peer_cases():
    counts = {peer_cases(f"glint {precision}")[:2] for precision in ("single", "strict", "double")}
    (both,) = counts
    return both


def spd(scene, program, key):
    rung = next(rung for rung in measured("peers-spd")["rungs"] if rung["scene"] == scene)
    return rung["programs"][program]["difference"][key]


def spd_rest():
    """Returns the largest share of pixels off where no other sentence states the reason."""
    named = ("balls", "glint single"), ("balls", "Tachyon"), ("teapot", "POV-Ray"), ("teapot", "Tachyon"), ("gears", "POV-Ray")
    return max(program["difference"]["pixels_off"] for rung in measured("peers-spd")["rungs"]
               for name, program in rung["programs"].items() if "difference" in program and (rung["scene"], name) not in named)


def tachyon_means():
    return [rung["programs"]["Tachyon"]["difference"]["mean"] for rung in measured("peers-spd")["rungs"]
            if "Tachyon" in rung["programs"] and rung["scene"] != "balls"]


# The ladder of ulps

def rungs(*forms, shapes=None, distances=lambda distance: True):
    return [rung for rung in measured("ulp-ladder")["rungs"]
            if rung["form"] in forms and (not shapes or rung["shape"] in shapes) and distances(rung["distance"])]


OWN = "single", "strict", "double"
ROUND = "sphere", "cylinder", "cone"


def ladder_wrong():
    wrong = [rung for rung in rungs(*OWN) if rung["wrong"] > 0]
    (rung,) = wrong
    return (sum(rung["rays"] for rung in rungs(*OWN)) / 1e6, rung["wrong"], rung["precision"], rung["shape"], rung["distance"])


def ladder_open(distances):
    return max(100 * rung["uncertain"] / rung["rays"] for rung in rungs(*OWN, distances=distances))


def textbook_wrong(shapes, *distances):
    """Returns the least and the most percentage."""
    wrong = [100 * rung["wrong"] / rung["rays"] for rung in rungs("textbook", shapes=shapes, distances=lambda d: d in distances)]
    return min(wrong), max(wrong)


def textbook():
    return (min(rung["steep"]["max"] for rung in rungs("textbook", shapes=ROUND, distances=lambda d: d >= 100)),
            *textbook_wrong(ROUND, 1e4, 1e5),
            *textbook_wrong(("torus",), 100, 1000, 1e4, 1e5))


def torus_beyond_its_bound():
    beyond = [rung for rung in rungs(*OWN) if rung["bound_fraction"] > 1]
    assert {(rung["shape"], rung["precision"]) for rung in beyond} == {("torus", "strict"), ("torus", "double")}
    assert {rung["distance"] for rung in beyond} == {1.0001, 1.01}, "the two nearest distances"
    return (max(rung["bound_fraction"] for rung in beyond),)


# Budgets

def budget_pilots():
    rows = measured("budgets")["rows"]
    assert all(row["error"] <= float(row["budget"]) for row in rows), "an image exceeds its budget"
    pilots = [row["pilot"]["total_ms"] for row in rows]
    return len({row["scene"] for row in rows}), len({row["budget"] for row in rows}), len(rows), statistics.median(pilots) / 1000


def budget_long(seconds):
    """Returns the number of rows that take longer at double, how many of them end at a faster precision, and their median times
    divided by that of double."""
    rows = [row for row in measured("budgets")["rows"] if row["double_ms"] > 1000 * seconds]
    ratio = {"double": [], "faster": []}
    for row in rows:
        ratio["double" if row["precision"] == "double" else "faster"].append((row["pilot"]["total_ms"] + row["render_ms"]) / row["double_ms"])
    faster, double = ratio["faster"], ratio["double"]
    return len(faster), len(rows), statistics.median(faster), len(double), statistics.median(double)


# Certified images

def certified_compared(precision):
    rows = measured("certified")["rows"]
    compared = sum(row["pixels"] - row["reference_uncertain"] for row in rows)
    return compared - sum(sum(row["wrong"][precision].values()) for row in rows), compared


# Hard cases

def verify_counts():
    """Returns the number of cases of the suite, which all precisions pass."""
    (count,) = {len(run["cases"]) for run in measured("verify")["precisions"]}
    assert all(run["failed"] == 0 for run in measured("verify")["precisions"])
    return count


def passed_elsewhere(report, implementation):
    """Returns the number of cases that all precisions pass, and that of precisions. The bits at strict must be PoCL's."""
    by_name = {entry["implementation"]: entry for entry in measured(report)["implementations"]}
    runs = by_name[implementation]["precisions"]
    (passed,) = {run["passed"] for run in runs}
    assert all(run["failed"] == 0 for run in runs)
    hashes = [{case["name"]: case["hash"] for case in run["cases"]} for name in ("pocl", implementation)
              for run in by_name[name]["precisions"] if run["precision"] == "strict"]
    assert hashes[0] == hashes[1], "other bits than PoCL's"
    return passed, len(runs)


def rusticl_of_mesa_22():
    """Returns the numbers of cases that pass at single and at strict, with PoCL's bits. The others were not answered."""
    pocl, rusticl = (entry["precisions"] for entry in measured("verify-rusticl")["implementations"])
    hashes = {(run["precision"], case["name"]): case["hash"] for run in pocl for case in run["cases"]}
    runs = {run["precision"]: run for run in rusticl if "cases" in run}
    for precision, run in runs.items():
        assert run["failed"] == 0
        assert all(case["hash"] == hashes[precision, case["name"]] for case in run["cases"]), "other bits than PoCL's"
    return runs["single"]["passed"], runs["strict"]["passed"]


def perturbed(precision, case):
    return [failure for run in measured("perturb")["runs"] if run["precision"] == precision
            for failure in run["failures"] if failure["name"] == case]


def perturbed_others():
    """Returns the names of failures at single other than R7, whose seeds are 1 to 20."""
    runs = [run for run in measured("perturb")["runs"] if run["precision"] == "single"]
    assert sorted({run["seed"] for run in runs}) == list(range(1, 21))
    return [failure["name"] for run in runs for failure in run["failures"] if failure["name"] != "R7"]


def scaling_cell(image, ranks):
    """Returns the value in the table that tools/measure/scaling --check tests."""
    row = next(line for line in read(ROOT / "docs/measurements/README.md").splitlines() if line.startswith(f"| {image} | {ranks} |"))
    return float(row.split("|")[3])


def growth(program, triangles):
    (row,) = (row for row in measured("growth")["rows"] if (row["kind"], row["program"], row["count"]) == ("bunny", program, triangles))
    return row["build_ms"], row["frame_ms"]


def lanes_frame(lanes):
    (run,) = (run for run in measured("bench-lanes")["runs"] if run["precision"] == "single" and run["lanes"] == lanes)
    return run["frame_ms"]["median"]


NUMBER = r"([\d.,]*\d(?:e[-+]?\d+)?)"
# Document, a pattern with a group for each number or name, and what these are by the measurements.
CLAIMS = [  # N stands for a number
    ("README.md", "glint renders a million triangles in N ms; Embree's packets take N ms. For N spheres glint takes N ms and Embree N ms, or N ms if "
                  "Embree calls glint's sphere test",
     lambda: (frame("bunny-1000000"), frame("bunny-1000000", "Embree packets"), 16, frame("spheres-16"), frame("spheres-16", "Embree packets"),
              frame("spheres-16", "Embree packets, our spheres"))),
    ("README.md", "None of N pixels compared in N scenes",
     lambda: (certified_compared("certified")[1], len(measured("certified")["rows"]))),
    ("README.md", "`glint verify` checks N cases", lambda: (verify_counts(),)),
    ("README.md", "At least one other program can run N of them. glint passes all N, POV-Ray N of N, Tachyon N of the N and Embree N of the N",
     lambda: (*glint_peer_cases()[::-1], *peer_cases("POV-Ray")[:2], *peer_cases("Tachyon")[:2], *peer_cases("Embree")[:2])),
    ("CHANGELOG.md", "a million spheres take N ms at 1920x1080 on two CPU cores, a million triangles N ms",
     lambda: (frame("spheres-1000000"), frame("bunny-1000000"))),
    ("docs/measurements/README.md", r"Among N million rays of all precisions N has a wrong hit or miss outside its band: at `(\w+)`, at a (\w+) "
                                    "N radii away", ladder_wrong),
    ("docs/measurements/README.md", "At most N% of a shape's rays from one distance lie in the band up to 100,000 radii, N% at a million",
     lambda: (ladder_open(lambda d: d <= 1e5), ladder_open(lambda d: d == 1e6))),
    ("docs/measurements/README.md", "The torus at its two nearest distances needs up to N times its bound", torus_beyond_its_bound),
    ("docs/measurements/README.md", "are off by N ulp or more from a hundred radii on, and their hits and misses are wrong for N to N% of the rays at "
                                    "10,000 and 100,000 radii; those of tori for N to N% from 100 to 100,000", textbook),
    ("docs/measurements/README.md", "In trials of N scenes and N budgets every image keeps its budget. The N pilots took N s in the median.", budget_pilots),
    ("docs/measurements/README.md", "Where `double` takes more than 0.15 s, N of N trials found a faster precision and took N of the time of `double` in "
                                    "the median; the other N took N of it.", lambda: budget_long(0.15)),
    ("docs/measurements/README.md", r"2026-11-28 \| N \| all pass at `single`, `strict` and `double`, with PoCL's bits at each",
     lambda: passed_elsewhere("verify-everywhere", "intel")[:1]),
    ("docs/measurements/README.md", r"\| N, a sixteenth of the rays \| all pass at `single` and `strict`, with PoCL's bits at both",
     lambda: passed_elsewhere("verify-rusticl-quick", "rusticl")[:1]),
    ("docs/measurements/README.md", "N pass at `single` and N at `strict`, with PoCL's bits at both", rusticl_of_mesa_22),
    ("docs/measurements/README.md", "except that R7 reaches N instead of 1e-5", lambda: (max(case["worst"] for case in perturbed("single", "R7")),)),
    ("docs/measurements/README.md", r"\| glint, each precision \| N of N \|", glint_peer_cases),
    ("docs/measurements/README.md", r"\| Embree \| N of N \| C3, C4, C7: .*?; M1: N of N rays leak .*?; C6, P3, S6: one ray each",
     lambda: (*peer_cases("Embree")[:2], *leaks("Embree", "M1"))),
    ("docs/measurements/README.md", r"\| Embree, not robust \| N of N \|", lambda: peer_cases("Embree without its robust flag")[:2]),
    ("docs/measurements/README.md", r"\| POV-Ray \| N of N \|", lambda: peer_cases("POV-Ray")[:2]),
    ("docs/measurements/README.md", r"\| Tachyon \| N of N \|", lambda: peer_cases("Tachyon")[:2]),
    ("docs/measurements/README.md", r"Tachyon truncates to 8 bits: a mean difference of N to N of 255 \(N in balls\)",
     lambda: (min(tachyon_means()), max(tachyon_means()), spd("balls", "Tachyon", "mean"))),
    ("docs/measurements/README.md", "past the last bounce Tachyon sees the background, glint and POV-Ray nothing: N% of the pixels",
     lambda: (100 * spd("balls", "Tachyon", "pixels_off"),)),
    ("docs/measurements/README.md", "glint's `single` is off in N%", lambda: (100 * spd("balls", "glint single", "pixels_off"),)),
    ("docs/measurements/README.md", "where the interpolated one would reflect into the surface: N% of the pixels",
     lambda: (100 * spd("teapot", "POV-Ray", "pixels_off"),)),
    ("docs/measurements/README.md", r"glint the fraction T \(0.8 here\): N%", lambda: (100 * spd("gears", "POV-Ray", "pixels_off"),)),
    ("docs/measurements/README.md", r"\(N ns per sample of `scenes/demo.yaml` on two cores, N ns per pixel for PNG\)",
     lambda: (1e9 * measured("scaling")["sample_seconds"], 1e9 * measured("scaling")["encode_seconds_per_pixel"])),
    ("docs/measurements/README.md", r"A million triangles build in N ms and render in N ms \(Embree: N and N ms\), ten million in N and N ms",
     lambda: (*growth("glint", 10**6), *growth("Embree", 10**6), *growth("glint", 10**7))),
    ("docs/performance.md", r"N ranks render an (\w+) image with an efficiency of N", lambda: (100, "8K", scaling_cell("8K", 100))),
    ("docs/measurements/README.md", "one lane takes N ms for `spheres16.yaml` at `single`, 16 lanes take N ms", lambda: (lanes_frame(1), lanes_frame(16))),
]
# Document, a sentence, and whether the measurements hold it up.
FACTS = [
    ("README.md", "differs in object, shadow or path from a quadruple-precision reference",
     lambda: certified_compared("certified")[0] == certified_compared("certified")[1]),
    ("docs/measurements/README.md", "Seeds 1 to 20 hold at `single`, except that R7", lambda: perturbed_others() == []),
    ("docs/measurements/README.md", "| C3, C4, C7: cones", lambda: peer_cases("Embree")[2] == ["C3", "C4", "C6", "C7", "M1", "P3", "S6"]),
    ("docs/measurements/README.md", "| these and P5 |",
     lambda: set(peer_cases("Embree without its robust flag")[2]) == {*peer_cases("Embree")[2], "P5"}),
    ("docs/measurements/README.md", "| P1, S6, R6: absolute tolerances; P5: triangles leak at edges |",
     lambda: peer_cases("POV-Ray")[2] == ["P1", "P5", "R6", "S6"]),
    ("docs/measurements/README.md", "| P2: a plane shadows itself; R6 |", lambda: peer_cases("Tachyon")[2] == ["P2", "R6"]),
    ("docs/measurements/README.md", "Elsewhere at most one pixel in a thousand is off, at edges.", lambda: spd_rest() <= 1e-3),
]


class Documents(unittest.TestCase):
    def test_agreement_is_at_the_digits_given(self):
        for words, value in ("1.5", 1.5499), ("1.50", 1.4951), ("3e-4", 3.4e-4), ("3.5e-4", 3.53e-4), ("47,176", 47176), ("29", 28.51):
            self.assertTrue(agrees(words, value), words)
        for words, value in ("1.5", 1.57), ("1.50", 1.51), ("3e-4", 3.6e-4), ("47,176", 47177), ("0.3", 2.56), ("strict", "single"):
            self.assertFalse(agrees(words, value), words)

    def test_numbers(self):
        for document, pattern, values in CLAIMS:
            pattern = re.sub(r"\bN\b", lambda _: NUMBER, pattern)
            with self.subTest(f"{document}: {pattern}"):
                found = re.search(pattern, text(document))
                self.assertIsNotNone(found, "the sentence has changed")
                expected = values()
                self.assertEqual(len(found.groups()), len(expected))
                for words, value in zip(found.groups(), expected):
                    self.assertTrue(agrees(words, value), f"{words}, measured {value}")

    def test_facts(self):
        for document, sentence, holds in FACTS:
            with self.subTest(f"{document}: {sentence}"):
                self.assertIn(sentence, text(document))
                self.assertTrue(holds())

    def test_the_ladder(self):
        """The table of ulps is what tools/numerics/ulp-ladder prints of its report."""
        loader = SourceFileLoader("ulp_ladder", str(ROOT / "tools/numerics/ulp-ladder"))
        tool = importlib.util.module_from_spec(importlib.util.spec_from_loader("ulp_ladder", loader))
        loader.exec_module(tool)
        with contextlib.redirect_stdout(io.StringIO()) as table:
            tool.print_table(measured("ulp-ladder")["rungs"], measured("ulp-ladder")["tests"])
        self.assertIn(table.getvalue().strip(), read(ROOT / "docs/measurements/README.md"))

    def test_shims(self):
        """The table of limits and violations has a row for each that the tests' shims know."""
        table = read(ROOT / "docs/measurements/README.md").partition("### Limits and violations")[2]
        rows = [re.sub(r"[:,] (a|boards|compilers|timers)\b.*|`", "", row) for row in re.findall(r"^\| (.*?) \|", table, re.M)][1:]
        limits = re.findall(r"^//   ([a-z][\w, -]*?)(?:=N)?  ", read(ROOT / "tests/shims/limits.c"), re.M)
        passport = read(ROOT / "tests/test_passport.py")
        violations = re.findall(r'^    "([\w, -]+)": \(', passport, re.M)
        timers = re.findall(r'"(\w+)":', re.search(r"^TIMERS = \{.*?\}", passport, re.M | re.S)[0])
        self.assertEqual(sorted("; ".join(rows).split("; ")), sorted([*", ".join(limits).split(", "), *violations, *timers]))

    def test_links(self):
        """Links of the documents lead to files and headings, and files that sources and tools name are there."""
        def anchors(page):
            return {re.sub(r"[^\w -]", "", heading).strip().lower().replace(" ", "-") for heading in re.findall(r"^#+ (.*)$", read(page), re.M)}

        for page in (*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")):
            for target in re.findall(r"\]\(([^)\s]*)\)", read(page)):
                path, _, anchor = target.partition("#")
                if not path.startswith("http"):
                    with self.subTest(f"{page.name}: {target}"):
                        self.assertTrue((page.parent / path).exists())
                        self.assertTrue(not anchor or anchor in anchors(page.parent / path if path else page))
        for folder in "host", "kernels", "tests", "tools":
            for path in ROOT.glob(f"{folder}/**/*"):
                if path.is_file() and path.suffix in (".c", ".h", ".cl", ".py", ".sh", ".bash", ""):
                    for page in re.findall(r"\bdocs/[\w-]+\.(?:md|[15])\b", path.read_text(errors="replace")):
                        with self.subTest(f"{path.relative_to(ROOT)}: {page}"):
                            self.assertTrue((ROOT / page).exists())


# Names of CSS Color Module Level 3, section 4, with their values.
COLORS = """aqua 00ffff black 000000 blue 0000ff brown a52a2a cyan 00ffff fuchsia ff00ff gold ffd700 gray 808080 green 008000 grey 808080
    lime 00ff00 magenta ff00ff maroon 800000 navy 000080 olive 808000 orange ffa500 pink ffc0cb purple 800080 red ff0000 silver c0c0c0
    teal 008080 violet ee82ee white ffffff yellow ffff00""".split()


class SceneFormat(TestCase):
    page = read(ROOT / "docs/scene-format.md")

    def test_examples_are_read(self):
        os.symlink(ROOT / "scenes", "scenes")
        names = []
        for language, example in re.findall(r"(?ms)^```(yaml|rt|cfg|nff)\n(.*?^)```$", self.page):
            names.append(write(f"{len(names)}.{language}", example))
        self.assertEqual([name[2:] for name in names], ["yaml", "yaml", "rt", "cfg", "nff"])
        self.assertEqual(self.glint(f"check {' '.join(names)}").stderr, "")

    def test_shapes_are_named(self):
        write("shape.yaml", "camera: {position: [0, 0, 5], look_at: [0, 0, 0]}\nobjects: [{x: {}}]\n")
        shapes = self.refuses("check shape.yaml", "unknown shape 'x'").stderr.partition("the choices are ")[2].splitlines()[0].split(", ")
        self.assertGreaterEqual(len(shapes), 13)
        for shape in shapes:
            self.assertIn(f"\n| `{shape}` | ", self.page)

    @unittest.skipUnless(has_device(), "there is no OpenCL device")
    def test_names_of_colors_are_those_of_css(self):
        names, values = COLORS[::2], [f"'#{value}'" for value in COLORS[1::2]]
        self.assertEqual(re.findall(r"`(\w+)`", self.page.partition("value in CSS: ")[2].partition("\n\n")[0]), names)
        for name, colors in ("names", names), ("values", values):
            balls = "".join(f"  - sphere: {{center: [{i - 11.5}, 0, 0], radius: 0.5, material: {{color: {color}, reflection: 0.1}}}}\n"
                            for i, color in enumerate(colors))
            camera = "camera: {position: [0, 0, -40], look_at: [0, 0, 0], fov: 3}\nambient: 1\n"
            write(f"{name}.yaml", camera + "".join(SPHERE.splitlines(True)[1:6]) + balls)
            self.glint(f"render {name}.yaml --size 96x8 -o {name}.npy")
        self.assertSameBytes("names.npy", "values.npy")


if __name__ == "__main__":
    main()
