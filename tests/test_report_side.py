#!/usr/bin/env -S python3 -B
"""Tests glint report with reports of glint bench: which rows are the same, what is stated about their times, and the page. No
device is used."""
import copy
import html
import json
import re
import shutil
import unittest
from pathlib import Path

from glint import TestCase, main, write
from test_html import dump

RUNS = 40
KEY = {"scene": "scenes/a.yaml", "scene_hash": "00000000000000a1", "precision": "single", "lanes": 16, "bvh": "auto",
       "size": [64, 48], "samples": 1, "bounces": 5}  # fmt: skip


def summary(times):
    return {"min": min(times), "median": sum(times) / len(times), "max": max(times), "quartile_range": 0, "runs": len(times)}


def run(milliseconds, **key):
    frames = [milliseconds * (1 + 0.002 * (i % 5 - 2)) for i in range(RUNS)]
    kernels = [0.5 * time for time in frames]
    return KEY | key | {"frame_ms": summary(frames), "kernel_ms": summary(kernels), "mrays_per_s": 100 / milliseconds,
                        "frame_samples_ms": frames, "kernel_samples_ms": kernels,
                        "processor_samples_ms": [2 * time for time in frames]}  # fmt: skip


def report(*runs, name="cpu-x", kind="cpu", host="here", rounds=1 << 20):
    return {"schema": 7, "glint": "0.9", "date": "2026-01-02T03:04:05Z", "host": {"name": host}, "build": {"commit": "c" * 40},
            "device": {"name": name, "board": None, "platform": "platform-x", "driver": "driver-x", "type": kind},
            "calibration": {"rounds": rounds, "samples_ms": [3.0] * RUNS, "processor_samples_ms": [6.0] * RUNS},
            "runs": list(runs)}  # fmt: skip


def save(path, value):
    return write(path, json.dumps(value))


def figures(text):
    """Returns the report's letter and the frame time, or "unavailable", of each line of a row."""
    return re.findall(r"(?m)^(?:.* )?([A-Z]) +(unavailable|[0-9.]+)", text.partition("frame ms")[2])


def embedded(page):
    return json.loads(re.search(r'<script type="application/json" id="report">\n(.*?)\n*</script>', page, re.DOTALL)[1])


class SideBySide(TestCase):
    def compared(self, *reports):
        """Returns what glint prints of the reports, and the data of the page."""
        paths = [save(f"{i}.json", value) for i, value in enumerate(reports)]
        out = self.glint(f"report {' '.join(paths)} --html page.html").stdout
        page = Path("page.html").read_text(encoding="utf-8")
        self.assertEqual(re.findall(r"(?:src|href)=\"(?!data:|#)[^\"]*\"|url\(|@import|https?://(?!www\.w3\.org/)", page), [])
        self.assertIn("default-src 'none'", page)
        self.assertNotIn("{{", page)
        return out, embedded(page)

    def test_one_host_and_device(self):
        """Verdicts are against the first report, whose scenes had other paths and whose rows another order."""
        older = report(run(10), run(20, scene_hash="00000000000000a2", scene="b.yaml"), run(5, precision="strict"))
        newer = report(run(5.5, precision="strict", scene="moved.yaml"), run(20.2, scene_hash="00000000000000a2"), run(5))
        out, data = self.compared(older, newer)
        self.assertEqual([(row["scene"], row["precision"]) for row in data["rows"]],
                         [("scenes/a.yaml", "single"), ("b.yaml", "single"), ("scenes/a.yaml", "strict")])  # fmt: skip
        cells = [row["cells"][1] for row in data["rows"]]
        self.assertEqual([cell["comparison"]["verdict"] for cell in cells], ["faster", "same", "slower"])
        for cell, ratio in zip(cells, (0.5, 1.01, 1.1), strict=True):
            self.assertAlmostEqual(cell["comparison"]["ratio"], ratio, places=9)
            self.assertTrue(cell["comparison"]["low"] < ratio < cell["comparison"]["high"] < 1.1 * ratio, cell)
        self.assertEqual([(letter, float(frame)) for letter, frame in figures(out)],
                         [("A", 10), ("B", 5), ("A", 20), ("B", 20.2), ("A", 5), ("B", 5.5)])  # fmt: skip
        self.assertRegex(out, r"(?m)^scene +precision +report +frame ms +quartile +quartile +kernel ms +A +verdict$")
        self.assertRegex(out, r"(?m)^ +B +5  +4\.990  +5\.010  +2\.500  0\.5000 \(0\.4\d\d to 0\.5\d\d\)  faster$")
        self.assertIn("3 rows, 3 of them with times in A: 0.822 of A's frame time (geometric mean), 1 faster, 1 slower, 1 same", out)
        self.assertAlmostEqual(data["reports"][1]["mean_ratio"], (0.5 * 1.01 * 1.1) ** (1 / 3), places=9)
        self.assertIn("\n\n64x48, lanes 16, BVH auto, samples 1, bounces 5\n", out)

    def test_calibration(self):
        """A host at half its speed explains twice the time, as in glint bench --compare. On a CPU its processor time counts."""
        older, newer = report(run(10), kind="gpu"), report(run(20), kind="gpu")
        newer["calibration"]["samples_ms"] = [6.0] * RUNS
        self.assertEqual(self.compared(older, newer)[1]["rows"][0]["cells"][1]["comparison"]["verdict"], "undecided")
        newer["calibration"]["samples_ms"] = [3.0] * RUNS
        self.assertEqual(self.compared(older, newer)[1]["rows"][0]["cells"][1]["comparison"]["verdict"], "slower")
        older, newer = report(run(10)), report(run(10))
        newer["runs"][0]["processor_samples_ms"] = [200] * RUNS
        self.assertEqual(self.compared(older, newer)[1]["rows"][0]["cells"][1]["comparison"]["verdict"], "slower")

    def test_no_verdict(self):
        """Without a verdict, only the ratio of medians is printed, and the reason."""
        older = report(run(10))
        boarded = report(run(5))
        boarded["device"]["board"] = "board-x"
        short = report(run(5))
        short["runs"][0]["frame_samples_ms"] = [5.0] * 19
        summarized = report(run(5))
        for name in "frame_samples_ms", "processor_samples_ms", "kernel_samples_ms":
            del summarized["runs"][0][name]
        uncalibrated = report(run(5))
        del uncalibrated["calibration"]
        unknown = report(run(5))
        del unknown["host"]
        for other, reason in [(report(run(5), name="gpu-x"), "another device"), (boarded, "another board"),
                              (report(run(5), host="there"), "another host"), (report(run(5), rounds=7), "it has another calibration or none"),
                              (uncalibrated, "it has another calibration or none"), (unknown, "the host of one of the reports is unknown"), (short, "too few runs"),
                              (summarized, "too few runs")]:  # fmt: skip
            with self.subTest(reason):
                out, data = self.compared(older, other)
                cell = data["rows"][0]["cells"][1]
                self.assertEqual((cell["comparison"]["ratio"], cell["kernel_ratio"]), (0.5, 0.5))
                self.assertNotIn("verdict", cell["comparison"])
                self.assertIn(reason, cell["comparison"]["why_not"])
                self.assertRegex(out, f"(?m)^ +no verdicts?, since .*{reason}")
                self.assertRegex(out, r"(?m)  0\.5000$")
        scrubbed = report(run(10), host="HOST")  # as glint report writes it
        self.assertIn("B  1.json: ", self.compared(older, older | {"schema": 6})[0])
        self.assertIn("the first report has another calibration or none", self.compared(uncalibrated, older)[0])
        self.assertIn("the host of one of the reports is unknown", self.compared(scrubbed, scrubbed)[0])
        self.assertNotIn("lower_quartile", self.compared(older, summarized)[1]["rows"][0]["cells"][1]["frame_ms"])

    def test_missing_rows(self):
        """Rows may be missing from some reports or may have failed, and two reports may have no row in common."""
        failed = KEY | {"precision": "double", "status": "unavailable", "reason": "no doubles here"}
        out, data = self.compared(report(run(10), run(30, samples=4)), report(run(10), failed), report(run(7, samples=4)))
        self.assertEqual([["frame_ms" in cell for cell in row["cells"]] for row in data["rows"]],
                         [[True, True, False], [True, False, True], [False, False, False]])  # fmt: skip
        self.assertEqual(data["rows"][2]["cells"][1]["reason"], "no doubles here")
        self.assertEqual([frame == "unavailable" for _, frame in figures(out)],
                         [False, False, True, False, True, False, True, True, True])  # fmt: skip
        self.assertRegex(out, r"(?m) B +unavailable: no doubles here$")
        self.assertRegex(out, r"(?m) C +unavailable: no such row$")
        self.assertEqual([entry["common"] for entry in data["reports"]], [0, 1, 1])
        out, data = self.compared(report(run(10)), report(run(10, bounces=6)))
        self.assertEqual(len(data["rows"]), 2)
        self.assertIn("1 row, 0 of them with times in A\n", out)

    def test_lanes(self):
        """A device's number of lanes does not make another row, but several numbers do. If they differ, no verdict is printed."""
        out, data = self.compared(report(run(10)), report(run(1, lanes=1), name="gpu-x", kind="gpu"), report(run(9, lanes=8)))
        self.assertEqual([[cell["lanes"] for cell in row["cells"]] for row in data["rows"]], [[16, 1, 8]])
        self.assertIn("their lanes differ", data["rows"][0]["cells"][2]["comparison"]["why_not"])
        self.assertRegex(out, "lanes +report +frame ms.*\n +16 +A .*\n +1 +B .*\n +8 +C .*\n    no verdict, since their lanes differ\n")
        data = self.compared(report(run(10)), report(run(20, lanes=1), run(9)))[1]
        self.assertEqual([[cell.get("lanes") for cell in row["cells"]] for row in data["rows"]], [[16, 16], [None, 1]])

    def test_one_report(self):
        out, data = self.compared(report(run(10), run(20, samples=2)))
        self.assertNotIn("times A", out)
        self.assertEqual([(len(row["cells"]), "comparison" in row["cells"][0]) for row in data["rows"]], [(1, False)] * 2)

    def test_refused(self):
        good = save("good.json", report(run(10)))
        save("old.json", report(run(10)) | {"schema": 5})
        save("new.json", report(run(10)) | {"schema": 8})
        save("empty.json", report())
        save("hashless.json", report(run(10), run(10, scene_hash="a1")))
        write("cut.json", Path(good).read_text(encoding="utf-8")[:-9])
        for path, reason in [("old.json", "'.* has schema 5, but glint reads 6 to 7; re-measure it"), ("new.json", "'.* has schema 8, but glint reads 6 to 7; re-measure it"), ("empty.json", "'.*has no rows"),
                             ("cut.json", r":\d+:\d+: error: not a report of glint bench --json: "),
                             ("hashless.json", "'.*row 2 has no valid scene_hash"), ("none.json", "'.*No such file")]:  # fmt: skip
            self.refuses(f"report {good} {path} --html page.html", f"{path}{reason}")
        self.refuses(f"report {good} S1", "^glint: 'S1' is not a report of glint bench, whose name ends in .json$")
        for option in "-o r.tar.gz", "--device 0", "--seconds 5":
            self.refuses(f"report {good} {option}", "--html is the only option for reports")
        self.refuses("report S1 --html page.html", "--html needs reports")
        self.refuses(f"report {good} --html -", "--html: expected the name of a file")
        self.refuses(f"report {good} --html ./good.json", "would overwrite the report 'good.json'")
        self.refuses(f"report {good} --html none/page.html", "none/page.html")
        self.refuses(f"report {' '.join([good] * 27)}", "at most 26")
        self.assertEqual(sorted(path.name for path in Path().iterdir()),
                         ["cut.json", "empty.json", "good.json", "hashless.json", "new.json", "old.json"])  # fmt: skip

    def test_names_are_escaped(self):
        name = "</script><!--<script>\"é'.yaml"
        data = self.compared(report(run(10, scene=name), run(1, scene_hash="00000000000000a2")), report(run(10), name="<b>"))[1]
        self.assertEqual((data["rows"][0]["scene"], data["reports"][1]["device"]), (name, "<b>"))
        self.assertNotIn("<b>", Path("page.html").read_text(encoding="utf-8"))

    @unittest.skipUnless(shutil.which("chromium"), "chromium is not installed")
    def test_drawn(self):
        """At both widths the page shows each row's name and times, without an error or anything wider than the page."""
        long = f"scenes/{'long-' * 30}.yaml"
        older = report(run(10), run(20, samples=4), run(3, scene_hash="00000000000000a2", scene=long))
        gpu = report(run(0.01, lanes=1), run(1e5, lanes=1, scene_hash="00000000000000a2"), name="gpu-x", kind="gpu")
        self.compared(older, copy.deepcopy(older) | {"runs": [run(5), run(21, samples=4)]}, gpu)
        page = Path("page.html").read_text(encoding="utf-8")
        start = "<script>const errors = []; for (const type of ['error', 'securitypolicyviolation'])" \
                "addEventListener(type, (event) => errors.push(event.message ?? event.blockedURI));</script>"
        probe = """<script>document.querySelector("select").value = "kernel"; drawBars();
            const read = (selector) => [...document.querySelectorAll(selector)].map((element) => element.textContent);
            const kernel = read(".bars td:nth-of-type(2)");
            document.querySelector("select").value = "frame"; drawBars();
            const found = { errors, kernel, names: read(".bars .name"), times: read(".bars td:nth-of-type(2)"), verdicts: read("td.verdict"),
              bars: document.querySelectorAll(".bars circle").length, width: innerWidth,
              overflow: document.documentElement.scrollWidth - document.documentElement.clientWidth };
            document.body.replaceChildren(JSON.stringify(found));</script>"""
        probed = page.replace("<head>", f"<head>{start}", 1).replace("</body>", f"{probe}</body>")
        framed = f'<body style="margin: 0"><iframe width="390" height="900" style="border: 0" srcdoc="{html.escape(probed)}">' \
                 "</iframe><script>onload = () => document.body.replaceChildren(" \
                 "document.querySelector('iframe').contentDocument.body.textContent)</script>"
        for width, shown in (1280, probed), (390, framed):
            drawn = dump(write("probed.html", shown), "--window-size=1280,900")
            found = json.loads(html.unescape(re.search("<body[^>]*>([^<]*)</body>", drawn)[1]))
            self.assertEqual((found["errors"], found["overflow"], found["width"]), ([], 0, width))
            self.assertEqual(found["names"], ["scenes/a.yaml, samples 1", "scenes/a.yaml, samples 4", f"{long}, samples 1"])
            self.assertEqual(found["times"], ["10.0", "5.00", "0.0100", "20.0", "21.0", "3.00", "1.0·10⁵"])
            self.assertEqual(found["kernel"][:3], ["5.00", "2.50", "5.0·10⁻³"])
            self.assertEqual([word for word in found["verdicts"] if word], ["faster", "same"])
            self.assertEqual(found["bars"], 7)


main()
