#!/usr/bin/env -S python3 -B
"""Tests glint diff: its exit status, what it refuses, its report as text and JSON, and its heat map.

run_tests: sanitized"""
import math
import struct

from glint import ROOT, SPHERE, TestCase, main, write


def ppm(path, gray, x=None, width=8, height=4):
    """Writes an image of one gray, black in column x of the first row."""
    pixels = "".join("0 0 0\n" if i == x else f"{gray} {gray} {gray}\n" for i in range(width * height))
    write(path, f"P3\n{width} {height}\n255\n{pixels}")


def npy(path, values, kind="<f8", shape=(1, 3)):
    """Writes an array in NumPy's format, of kind "<f8", "<f4" or "<u4"."""
    header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    letter = {"<f8": "d", "<f4": "f", "<u4": "I"}[kind]
    with open(path, "wb") as file:
        file.write(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode())
        file.write(struct.pack(f"<{len(values)}{letter}", *values))


class Diff(TestCase):
    def setUp(self):
        super().setUp()
        ppm("plain.ppm", 128)
        ppm("same.ppm", 128)
        ppm("spot.ppm", 128, x=5)
        ppm("lighter.ppm", 129)
        ppm("turned.ppm", 128, width=4, height=8)

    def test_equal(self):
        self.assertIn("equal, bit for bit", self.glint("diff plain.ppm plain.ppm").stdout)
        self.glint("diff plain.ppm same.ppm --heatmap equal.png")
        with open("equal.png", "rb") as file:
            self.assertTrue(file.read())

    def test_differing(self):
        one_pixel = self.glint("diff plain.ppm spot.ppm", status=3).stdout
        self.assertIn("3 of 96 values differ", one_pixel)
        self.assertRegex(one_pixel, "worst .* 5,0: 0.501960814")
        one_step = self.glint("diff plain.ppm lighter.ppm", status=3).stdout
        self.assertIn("96 values differ by 1, 0 by more, PSNR 48.13 dB", one_step)

    def test_files_are_compared_at_their_own_width(self):
        npy("exact.npy", (1, 2, 1 / 3))
        npy("near.npy", (1, 2 + 1e-12, 1 / 3))
        self.assertIn("equal, bit for bit", self.glint("diff exact.npy exact.npy").stdout)
        report = self.glint("diff exact.npy near.npy", status=3).stdout
        self.assertIn("1 of 3 values differ", report)
        self.assertRegex(report, r"(?s)max 1e-12, .* worst +pixel 1,0: 2 and 2\.00000000000[01]\d+")
        npy("rounded.npy", (1, 2, 1 / 3), "<f4")
        self.assertIn("1 of 3 values differ", self.glint("diff exact.npy rounded.npy", status=3).stdout)
        npy("ids.npy", (1, 2, 16777216), "<u4")
        npy("other_ids.npy", (1, 2, 16777217), "<u4")
        self.assertIn("1 of 3 values differ", self.glint("diff ids.npy other_ids.npy", status=3).stdout)

    def test_distances_are_not_light(self):
        npy("t.npy", (1, 2, 4))
        npy("farther.npy", (1, 2, 5))
        report = self.glint("diff t.npy farther.npy", status=3).stdout
        self.assertIn("3x1, 1 channel of data\n", report)
        self.assertIn("data       max 1,", report)
        self.assertNotIn("light", report)
        self.assertNotIn("FLIP", report)
        self.assertEqual(self.json("diff t.npy farther.npy --json", status=3)["kind"], "data")

    def test_refused(self):
        npy("t.npy", (1, 2, 4))
        npy("ids.npy", (1, 2, 4), "<u4")
        npy("light.npy", [0.5] * 96, "<f4", (4, 8, 3))
        for command, pattern in (
            ("plain.ppm turned.ppm", "8x4 with 3 .* 4x8 with 3"),
            ("plain.ppm light.npy", "the first image holds display values, the second linear light"),
            ("plain.ppm missing.png", "missing.png"),
            ("plain.ppm", "two"),
            (f"plain.ppm {ROOT}/scenes/demo.yaml", "demo.yaml"),
            ("plain.ppm spot.ppm --heatmap map.jpg", r"\.png"),
            ("plain.ppm same.ppm --layer depth", "--layer is for EXR files, but neither name ends in .exr"),
            ("plain.ppm spot.ppm --heatmap none/map.png", "none/map.png"),
            ("plain.ppm spot.ppm --max-ulp 1", '--max-ulp: "plain.ppm" and "spot.ppm" do not both have floating-point values'),
            ("t.npy t.npy --max-flip 1", '--max-flip: "t.npy" and "t.npy" do not both have colors'),
            ("t.npy t.npy --max-off 1", '--max-off: "t.npy" and "t.npy" do not both have colors'),
            ("ids.npy ids.npy --max-ulp 1", '"ids.npy" and "ids.npy" do not both have floating-point values'),
            ("t.npy ids.npy --max-ulp 1", '"t.npy" and "ids.npy" do not both have floating-point values'),
            ("t.npy t.npy --max-rmse -1", "--max-rmse: expected a number of at least 0, not \"-1\""),
            ("t.npy t.npy --max-rmse 1%", "--max-rmse: expected a number"),
            ("t.npy t.npy --max-rmse nan", "--max-rmse: expected a number"),
        ):
            with self.subTest(command):
                self.refuses(f"diff {command}", pattern)

    def test_json(self):
        report = self.json("diff plain.ppm spot.ppm --json", status=3)
        self.assertEqual((report["schema"], report["size"], report["equal"]), (2, [8, 4], False))
        self.assertEqual((report["srgb8"]["off_by_1"], report["srgb8"]["off_by_2_or_more"]), (0, 3))
        self.assertEqual(set(report["srgb8"]), {"psnr", "off_by_1", "off_by_2_or_more"})
        self.assertEqual((report["worst"]["x"], report["worst"]["y"], report["worst"]["image"]), (5, 0, [0, 0, 0]))
        self.assertGreater(report["flip"]["max"], 0.05)
        self.assertEqual(report["flip"]["pixels_per_degree"], 67)

    def test_values(self):
        """Values by hand, or those of FLIP by its authors' program, flip-evaluator 1.7. test_diff_metrics.py has more."""
        side, count, nan, inf = 64, 64 * 64, math.nan, math.inf
        light = ((128 / 255 + 0.055) / 1.055) ** 2.4
        for name, gray, x in ("gray", 128, None), ("spot", 128, 20 * side + 40), ("step", 129, None), ("black", 0, None), ("white", 255, None):
            ppm(f"{name}.ppm", gray, x, side, side)
        holes = [128 / 255] * 3 * count
        holes[30] = inf
        npy("full.npy", holes, "<f4", (side, side, 3))
        holes[3 * (2 * side + 7) + 1] = nan
        npy("holes.npy", holes, "<f4", (side, side, 3))
        npy("few.npy", (0, 1, nan, 2, 4, 3), shape=(1, 6))
        npy("others.npy", (1, 1, 5, 2, 2, -inf), shape=(1, 6))
        # every number 1e-6 to 5000e-6 once, in a jumble, of both signs
        npy("zeros.npy", [0] * 5000, shape=(1, 5000))
        npy("jumble.npy", [(i * 1237 % 5000 + 1) * (1e-6 if i % 2 else -1e-6) for i in range(5000)], shape=(1, 5000))
        for reference, image, values in (
            ("gray.ppm", "gray.ppm", {
                "differing_values": 0, "srgb8.off_by_1": 0, "srgb8.off_by_2_or_more": 0, "linear.psnr": inf, "srgb8.psnr": inf,
                "flip.mean": 0, "flip.max": 0, "linear.max_abs": 0}),
            ("gray.ppm", "spot.ppm", {
                "differing_values": 3, "srgb8.off_by_1": 0, "srgb8.off_by_2_or_more": 3, "worst.x": 40, "worst.y": 20,
                "linear.max_abs": (light, 1e-7), "linear.rmse": (light / side, 1e-8), "linear.bias": (-light / count, 1e-9),
                "linear.p99_9": 0,  # 1 of 4096 is less than 0.1 %
                "linear.rel_mse": (light**2 / (light**2 + 0.01) / count, 1e-9),
                "srgb8.psnr": (10 * math.log10(count * 255**2 / 128**2), 1e-9),
                "flip.mean": (0.00041315, 1e-7), "flip.max": (0.171734, 2e-6)}),
            ("gray.ppm", "step.ppm", {
                "srgb8.off_by_1": 3 * count, "srgb8.off_by_2_or_more": 0, "srgb8.psnr": (48.1308, 1e-4),
                "flip.mean": (0.0298688, 1e-5), "flip.max": (0.0298688, 1e-5)}),
            ("black.ppm", "white.ppm", {"linear.psnr": (0, 1e-9), "linear.rel_mse": (100, 1e-9), "flip.mean": (0.967392, 1e-5)}),
            ("full.npy", "holes.npy", {
                "differing_values": 1, "nonfinite_pixels.reference": 1, "nonfinite_pixels.image": 2, "linear.values": 3 * count - 2,
                "linear.max_abs": 0, "worst.x": 7, "worst.y": 2, "flip.max": (0.5, 0.499)}),  # the missing number shows as none
            ("few.npy", "others.npy", {
                "linear.values": 4, "linear.max_abs": 2, "linear.bias": -0.25, "linear.rmse": (1.25**0.5, 1e-15),
                "linear.psnr": (-10 * math.log10(1.25), 1e-14), "linear.rel_mse": ((1 / 0.01 + 4 / 16.01) / 4, 1e-13), "linear.p99_9": 2}),
            ("zeros.npy", "jumble.npy", {"linear.p99_9": (4995e-6, 1e-9), "linear.max_abs": (5000e-6, 1e-9)}),
        ):
            report = self.json(f"diff {reference} {image} --json", status=0 if reference == image else 3)
            for key, expected in values.items():
                group, _, member = key.partition(".")
                found = report[group][member] if member else report[group]
                found = inf if found is None else found  # JSON has no infinity
                value, tolerance = expected if isinstance(expected, tuple) else (expected, 0)
                with self.subTest(f"{image}: {key}"):
                    self.assertTrue(found == value or abs(found - value) <= tolerance, f"{found}, expected {value}")

    def verdicts(self, command, status):
        report = self.json(f"diff {command} --json", status=status)
        self.assertEqual(report["met"], status == 0)
        return {name: (limit["limit"], limit["value"], limit["met"]) for name, limit in report["limits"].items()}

    def test_limits_of_images(self):
        self.assertEqual(self.verdicts("plain.ppm lighter.ppm --max-off 96", 0), {"off": (96, 96, True)})
        self.assertEqual(self.verdicts("plain.ppm lighter.ppm --max-off 95", 3), {"off": (95, 96, False)})
        full = self.json("diff plain.ppm lighter.ppm --json", status=3)
        self.assertFalse({"limits", "met"} & set(full))
        for name, value in ("rmse", full["linear"]["rmse"]), ("flip", full["flip"]["mean"]):
            below, above = value * (1 - 1e-9), value * (1 + 1e-9)
            self.assertEqual(self.verdicts(f"plain.ppm lighter.ppm --max-{name} {above!r}", 0), {name: (above, value, True)})
            self.assertEqual(self.verdicts(f"plain.ppm lighter.ppm --max-{name} {below!r}", 3), {name: (below, value, False)})
        text = self.glint("diff plain.ppm spot.ppm --max-rmse 0.1 --max-off 2 --max-flip 0.5", status=3).stdout
        self.assertRegex(text, r"(?m)^  met +--max-rmse 0\.1: RMSE 0\.0\d+$")
        self.assertRegex(text, r"(?m)^  exceeded +--max-off 2: differing 8-bit values 3$")
        self.assertEqual(text.count("exceeded"), 1)
        self.assertIn("  met        --max-off 0: differing 8-bit values 0\n",
                      self.glint("diff plain.ppm same.ppm --max-off 0").stdout)

    def test_limits_in_units_in_the_last_place(self):
        for kind, least in ("<f4", 2.0**-23), ("<f8", 2.0**-52):
            npy("t.npy", (1, 2, 3), kind)
            npy("near.npy", (1 + 5 * least, 2 - least, 3 + 4 * least), kind)
            self.assertEqual(self.verdicts("t.npy near.npy --max-ulp 5", 0), {"ulp": (5, 5, True)})
            self.assertEqual(self.verdicts("t.npy near.npy --max-ulp 4.5", 3), {"ulp": (4.5, 5, False)})
        npy("exact.npy", (1 / 3, 2, 0))
        npy("rounded.npy", (1 / 3, 2, 2.0**-149), "<f4")
        self.assertEqual(self.verdicts("exact.npy rounded.npy --max-ulp 1", 0), {"ulp": (1, 1, True)})

    def test_what_is_finite_in_one_image_alone_exceeds_every_limit(self):
        inf, nan = float("inf"), float("nan")
        npy("hits.npy", (1, inf, nan), "<f4")
        npy("same.npy", (1 + 2.0**-23, inf, nan), "<f4")
        self.glint("diff hits.npy same.npy --max-rmse 1 --max-ulp 1")
        for values in (1, 2, nan), (1, inf, inf), (1, -inf, nan), (inf, inf, nan):
            npy("other.npy", values, "<f4")
            limits = self.verdicts("hits.npy other.npy --max-rmse 1e9 --max-ulp 1e9", 3)
            self.assertFalse(limits["rmse"][2] or limits["ulp"][2], values)
        self.assertIn("exceeded   every limit: 1 value is not finite and not the same in both",
                      self.glint("diff hits.npy other.npy --max-rmse 1", status=3).stdout)

    def test_limits_of_a_distance_map(self):
        write("sphere.yaml", SPHERE)
        for precision in "single", "double":
            self.glint(f"render sphere.yaml --size 48x32 --aov t --precision {precision} -o {precision}.png")
        far = self.json("diff double.t.npy single.t.npy --max-ulp 1e6 --json")["limits"]["ulp"]["value"]
        self.assertTrue(0 < far < 100, far)
        self.glint(f"diff double.t.npy single.t.npy --max-ulp {far * 0.99}", status=3)

    def test_heat_map_is_white_at_the_pixel_that_differs_and_black_elsewhere(self):
        self.assertIn('"white": 0.2158605', self.glint("diff plain.ppm spot.ppm --heatmap map.ppm --json", status=3).stdout)
        with open("map.ppm", "rb") as file:
            self.assertEqual(file.read()[-96:], bytes(15) + b"\xff\xff\xff" + bytes(78))


if __name__ == "__main__":
    main()
