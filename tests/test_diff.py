#!/usr/bin/env -S python3 -B
"""glint diff: exit status, what it refuses, its report as text and JSON, its heat map."""
import struct

from glint import ROOT, TestCase, main, write


def ppm(path, gray, x=None, width=8, height=4):
    """An image of one gray, black in column x of the first row."""
    pixels = "".join("0 0 0\n" if i == x else f"{gray} {gray} {gray}\n" for i in range(width * height))
    write(path, f"P3\n{width} {height}\n255\n{pixels}")


def npy(path, values, kind="<f8", shape=(1, 3)):
    """An array of NumPy's format, kind "<f8", "<f4" or "<u4"."""
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
        for command, pattern in (
            ("plain.ppm turned.ppm", "8x4 with 3 .* 4x8 with 3"),
            ("plain.ppm missing.png", "missing.png"),
            ("plain.ppm", "two"),
            (f"plain.ppm {ROOT}/scenes/demo.yaml", "demo.yaml"),
            ("plain.ppm spot.ppm --heatmap map.jpg", r"\.png"),
            ("plain.ppm spot.ppm --heatmap none/map.png", "none/map.png"),
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

    def test_heat_map_is_white_at_the_pixel_that_differs_and_black_elsewhere(self):
        self.assertIn('"white": 0.2158605', self.glint("diff plain.ppm spot.ppm --heatmap map.ppm --json", status=3).stdout)
        with open("map.ppm", "rb") as file:
            self.assertEqual(file.read()[-96:], bytes(15) + b"\xff\xff\xff" + bytes(78))


if __name__ == "__main__":
    main()
