#!/usr/bin/env -S python3 -B
"""Tests glint diff: its exit status, what it refuses, its report as text and JSON, and its heat map.

run_tests: sanitized"""
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
        for command, pattern in (
            ("plain.ppm turned.ppm", "8x4 with 3 .* 4x8 with 3"),
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
