#!/usr/bin/env -S python3 -B
"""Tests the HTML report of glint accuracy: the JSON in it, and what chromium draws from that, as html_probe.js reads it back.

run_tests: sanitize-long-only"""
import html
import json
import math
import os
import re
import shutil
import subprocess
from pathlib import Path

from glint import IS_SANITIZED, ROOT, TestCase, main, need_device, plain, skip_all, write

CHROMIUM = shutil.which("chromium")
SMALL = "--size 120x80 --seconds 0.2"

# The figure of each kind that docs/accuracy.md says is plotted.
PLOTTED = {
    "object": lambda errors: errors["object"]["edge"] + errors["object"]["away"],
    "shadow": lambda errors: errors["shadow"]["edge"] + errors["shadow"]["away"],
    "path": lambda errors: errors["path"]["edge"] + errors["path"]["away"],
    "shading": lambda errors: errors["shading"]["rmse"],
    "t": lambda errors: errors["t"]["relative"]["p99_9"],
    "normal": lambda errors: errors["normal"]["p99_9"],
    "image": lambda errors: errors["image"]["rmse"],
    "flip": lambda errors: errors["image"]["flip_mean"],
}
# Members of a variant by heading, table by table.
COLUMNS = [
    {"Frame, ms": "frame_ms.median", "Shortest": "frame_ms.min", "Longest": "frame_ms.max", "Runs": "frame_ms.runs",
     "Kernels, ms": "kernel_ms.median", "Million rays per second": "mrays_per_s"},
    {"Not finite": "errors.nonfinite", "Negative": "errors.negative", "Object, at silhouettes": "errors.object.edge",
     "Object, away": "errors.object.away", "Shadow, at edges": "errors.shadow.edge", "Shadow, away": "errors.shadow.away",
     "Path, at edges": "errors.path.edge", "Path, away": "errors.path.away"},
    {"Shading, RMSE": "errors.shading.rmse", "Shading, largest": "errors.shading.max", "Shading, bias": "errors.shading.bias",
     "Shading, 99.9%": "errors.shading.p99_9", "Distance, 99.9%": "errors.t.relative.p99_9",
     "Distance, largest": "errors.t.relative.max", "Distance, 99.9%, ulp": "errors.t.ulps.p99_9",
     "Distance, largest, ulp": "errors.t.ulps.max", "Normal, 99.9%": "errors.normal.p99_9",
     "Normal, largest": "errors.normal.max"},
    {"RMSE": "errors.image.rmse", "PSNR, dB": "errors.image.psnr", "relMSE": "errors.image.rel_mse",
     "8-bit PSNR, dB": "errors.image.srgb_psnr", "8-bit values off by 1": "errors.image.off_by_1",
     "off by more": "errors.image.off_by_more", "FLIP, mean": "errors.image.flip_mean",
     "FLIP, largest": "errors.image.flip_max"},
]  # fmt: skip


def member(value, path):
    for name in path.split("."):
        value = value.get(name) if isinstance(value, dict) else None
    return value


def printed_number(text):
    """Reads a printed number. 3.1·10⁻⁶ is 3.1e-6, 921 600 with narrow spaces 921600, ∞ infinity."""
    text = text.replace("−", "-").replace("\u202f", "").replace("∞", "inf")
    power = re.fullmatch("(?:(.*)·)?10([⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+)", text)
    digits = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
    return float(f"{power[1] or 1}e{power[2].translate(digits)}" if power else text)


def srgb_8_bits(value):
    """Returns the display value of IEC 61966-2-1:1999."""
    value = min(max(value, 0.0), 1.0)
    return math.floor(255 * (12.92 * value if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055) + 0.5)


def dump(page, *options):
    """Returns the document as chromium has it once it is loaded."""
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={Path('browser').resolve()}"]
    process = subprocess.run([*command, *options, "--dump-dom", Path(page).resolve().as_uri()], stdout=subprocess.PIPE,
                             stderr=subprocess.DEVNULL, encoding="utf-8", timeout=120, check=True)  # fmt: skip
    return process.stdout


class Html(TestCase):
    def setUp(self):
        super().setUp()
        os.mkdir("scene")
        shutil.copy(plain("spheres16.yaml", "scene"), "spheres16.yaml")

    def page(self, arguments):
        """Runs glint accuracy, and checks the JSON in the page against that on standard output. Returns both."""
        process = self.glint(f"accuracy {SMALL} {arguments} --html page.html --json")
        page = Path("page.html").read_text(encoding="utf-8")
        embedded = re.search(r'<script type="application/json" id="report">\n(.*?)\n*</script>', page, re.DOTALL)[1]
        self.assertNotIn("<", embedded)
        self.assertEqual(embedded.replace("\\u003c", "<").strip(), process.stdout.strip())
        self.assertEqual(re.findall(r"(?:src|href)=\"(?!data:|#)[^\"]*\"|url\(|@import", page), [])
        report = json.loads(process.stdout)
        for precision in {variant["precision"] for scene in report["scenes"] for variant in scene["variants"]}:
            self.assertIn(f'id="mark-{precision}"', page)
            self.assertRegex(page, rf"(?m)^\.{precision} {{ --mark:")
        return page, report

    def check_axis(self, ticks, points):
        """Checks that ticks and points, value and position, lie as on a logarithmic axis, where 0 has a separate tick."""
        position = {tick["value"]: tick["position"] for tick in ticks}
        first, last = min(filter(None, position), default=1), max(position)
        for value, found in [*position.items(), *points]:
            part = value and math.log(value / first) / math.log(last / first)
            expected = position[first] + part * (position[last] - position[first]) if value else position[0]
            self.assertAlmostEqual(found, expected, delta=0.05)
        for tick in ticks:
            self.assertAlmostEqual(printed_number(tick.get("label", str(tick["value"]))), tick["value"])

    def check_panel(self, panel, scene):
        kind, variants, times, errors = panel["kind"], scene["variants"], [], []
        expected = [i for i, variant in enumerate(variants) if kind in variant.get("pareto", {})]
        self.assertEqual([point["variant"] for point in panel["points"]], expected)
        for point in panel["points"]:
            variant = variants[point["variant"]]
            times += zip((variant["frame_ms"][end] for end in ("min", "median", "max")), point["x"])
            errors.append((PLOTTED[kind](variant["errors"]), point["y"]))
            self.assertEqual((point["hollow"], point["crossed"]), (not variant["pareto"][kind], variant["crossed_out"]))
        self.check_axis(panel["x"], times)
        self.check_axis(panel["y"], errors)

    def check_labels(self, panels, chosen):
        """Checks that each point has its name, except in small panels with long names. No name covers a text, and a mark under
        another one shows through."""
        for panel in [*panels, *chosen]:
            self.assertEqual((panel["covering"], panel["opaque"]), ([], 0))
            self.assertIn(len(panel["labels"]), {panel["points"]} if panel in chosen else {0, panel["points"]})
            self.assertGreater(10.5 * panel["scale"], 9, "pixels of text")

    def check_tables(self, tables, scene):
        """Checks every value, and its order after one and after two clicks on the heading."""
        colors_only = scene["reference"]["kind"] == "file"
        listed = [columns for columns in COLUMNS if not (colors_only and "Normal, largest" in columns)]
        for columns, table in zip(listed, tables, strict=True):
            for heading, path in columns.items():
                values = [member(variant, path) for variant in scene["variants"]]
                values = [math.inf if "psnr" in path and value is None else value for value in values]
                for order, rows in table[heading].items():
                    for index, text in rows:
                        self.assertEqual(text == "–", values[index] is None, heading)
                        if text != "–" and values[index] != math.inf:
                            delta = 0.051 * abs(values[index])
                            self.assertAlmostEqual(printed_number(text), values[index], delta=delta, msg=heading)
                    found = [values[index] for index, text in rows if text != "–"]
                    self.assertEqual(found, sorted(found, reverse=order == "descending"), f"{heading}, {order}")

    def check_colors(self, pixels, scene):
        """Checks that the worst pixels have the colors in the figures, in the reference's image and in the variant's."""
        for pixel in pixels:
            worst = scene["variants"][pixel["variant"]]["worst"][pixel["kind"]]
            expected = [*map(srgb_8_bits, worst["reference_color"]), *map(srgb_8_bits, worst["variant_color"])]
            for channel, other in zip(pixel["colors"], expected, strict=True):
                self.assertAlmostEqual(channel, other, delta=1, msg=pixel)

    def check_drawn(self, page, report):
        """Checks what html_probe.js finds in the page."""
        if not CHROMIUM or IS_SANITIZED:  # a sanitized build's page is that of the other build
            self.skipTest("sanitized" if IS_SANITIZED else "there is no chromium")
        probe = (ROOT / "tests/html_probe.js").read_text(encoding="utf-8")
        start = "<script>\"use strict\"; const errors = []; for (const type of ['error', 'securitypolicyviolation'])" \
                "addEventListener(type, (event) => errors.push(event.message ?? event.blockedURI));</script>"
        probed = page.replace("<head>", f"<head>{start}", 1).replace("</body>", f"<script>{probe}</script></body>")
        # chromium's windows cannot be narrower than 500 pixels, but a frame can
        framed = f'<body style="margin: 0"><iframe width="390" height="900" style="border: 0" srcdoc="{html.escape(probed)}">' \
                 "</iframe><script>onload = () => document.body.replaceChildren(" \
                 "document.querySelector('iframe').contentDocument.getElementById('found'))</script>"
        for width, shown in (1280, probed), (390, framed):
            drawn = dump(write("probed.html", shown), "--window-size=1280,900")
            found = json.loads(re.search(r'<script id="found"[^>]*>(.*?)</script>', drawn, re.DOTALL)[1])
            self.assertEqual((found["errors"], found["loaded"]), ([], []))
            self.assertEqual((found["width"], found["overflow"]), (width, 0))
            self.assertEqual((found["wide"], found["hiddenBudgets"]), ([], [0]), f"{width} pixels")
            self.assertEqual([drawn["heading"] for drawn in found["scenes"]], [scene["scene"] for scene in report["scenes"]])
            for drawn, scene in zip(found["scenes"], report["scenes"], strict=True):
                source, device = (scene["reference"].get(name) for name in ("file", "device"))
                own = "the device’s own image" if device == report["device"]["name"] else f"the image of {device}"
                self.assertIn(f"Compared with {source or own}", drawn["facts"])
                measures = {kind for variant in scene["variants"] for kind in variant.get("pareto", {})}
                self.assertEqual({panel["kind"] for panel in drawn["panels"]}, measures)
                self.assertEqual(drawn["chosenWide"], [], f"{width} pixels")
                self.check_labels(drawn["labels"], drawn["chosenLabels"])
                for panel in [*drawn["panels"], *drawn["chosen"]]:
                    self.check_panel(panel, scene)
                self.assertEqual([panel["kind"] for panel in drawn["chosen"]], ["image"])
                self.check_tables(drawn["tables"], scene)
                self.check_colors(drawn["pixels"], scene)
                self.assertEqual(drawn["broken"], 0, "images")
                self.assertEqual(drawn["split"], [50, 25])
                self.assertTrue(drawn["chosenIsShown"])
                self.assertEqual(drawn["zoom"], 8)
                self.assertLess(max(drawn["offCenter"]), 2, "the worst pixel")
        sandbox = f'<iframe sandbox="allow-same-origin" srcdoc="{html.escape(page)}"></iframe><script>onload = () =>' \
                  "document.body.replaceChildren(document.querySelector('iframe').contentDocument.body.innerText)</script>"
        self.assertIn("JavaScript draws this report", dump(write("sandbox.html", sandbox)))

    def test_two_scenes(self):
        name = f"<!--<script>&\"é{'-long' * 40}.yaml"
        shutil.copy("spheres16.yaml", name)
        page, report = self.page(f"spheres16.yaml '{name}' --precision single,strict,certified,double")
        self.assertEqual(len(report["scenes"][0]["picks"]), 3)
        self.check_drawn(page, report)

    def test_crossed_out(self):
        """Errors a thousand times those of any device put shadows on whole spheres."""
        page, report = self.page("spheres16.yaml --precision single --samples 1,2 --perturb 1:1000")
        self.assertTrue(report["scenes"][0]["variants"][0]["crossed_out"])
        reference = report["scenes"][0]["reference"]
        before, reference["device"] = json.dumps(reference["device"]), "another device"
        page, count = re.subn(rf'("reference": {{[^}}]*"device": ){re.escape(before)}', r'\1"another device"', page)
        self.assertEqual(count, 1)
        self.check_drawn(page, report)

    def test_reference_from_a_file(self):
        """A reference from a file has only colors, so the page shows no errors of distances and normals."""
        self.glint("render spheres16.yaml --size 120x80 --precision double -o reference.npy")
        page, report = self.page("spheres16.yaml --precision single,double --reference reference.npy")
        self.check_drawn(page, report)

    def test_refused_before_measuring(self):
        self.refuses("accuracy spheres16.yaml --html -", "--html: expected the name of a file")
        self.refuses("accuracy spheres16.yaml --html nowhere/page.html", "nowhere/page.html")


if __name__ == "__main__":
    if not need_device()["fp64"]:
        skip_all("the device has no 64-bit floating point for a reference")
    main()
