#!/usr/bin/env -S python3 -B
"""Tests motion blur. A frame's samples must show the scene at times between it and the next, while the shutter is open."""
import math
import os

from glint import POCL, SPHERE, TWO, TestCase, main, need_pocl, npy_read, png_read, write

# A disc of radius 0.5, whose colors are its coverage and whose center moves from x = -0.75 to 0.75 between frames 1 and 1.5.
DISC = """\
camera: {position: [0, 0, 4], look_at: [0, 0, 0], height: 1.2}
frames: 2
shutter: 0.5
ambient: 1
objects: [{sphere: {center: {keys: {1: [-0.75, 0, 0], 2: [2.25, 0, 0]}}, radius: 0.5, material: {color: white}}}]
"""
WIDTH, HEIGHT = 64, 24
MOVING = "shutter: 1\n" + SPHERE.replace("radius: 1", "radius: {keys: {0: 1, 1: 0.5}}")
SIZE = "--size 32x24 --samples 6 --quiet"


def covered(x, y):
    """Returns the fraction of the time for which the disc covers a point."""
    half = math.sqrt(max(0, 0.25 - y * y))
    return max(0, min(x + half, 0.75) - max(x - half, -0.75)) / 1.5


def coverage(column, row):
    """Returns the mean coverage over a pixel."""
    steps = [(i + 0.5) / 8 for i in range(8)]
    return sum(covered((column + i - WIDTH / 2) * 1.2 / HEIGHT, (row + j - HEIGHT / 2) * 1.2 / HEIGHT)
               for i in steps for j in steps) / 64


def colors(path):
    return [value for pixel in npy_read(path)[2] for value in pixel]


class Shutter(TestCase):
    def setUp(self):
        super().setUp()
        write("moving.yaml", MOVING)

    def furthest(self, path, other):
        return max(abs(a - b) for a, b in zip(colors(path), colors(other)))

    def test_coverage(self):
        """Each pixel has the fraction of time for which it is covered, with as many times as samples and with more samples than times."""
        write("disc.yaml", DISC)
        expected = [coverage(column, row) for row in range(HEIGHT) for column in range(WIDTH)]
        for samples, most in (64, 0.08), (300, 0.03):
            self.glint(f"render disc.yaml --frames 1 --size {WIDTH}x{HEIGHT} --lanes 1 --samples {samples} --quiet -o disc.npy", env=POCL)
            differences = [red - mean for (red, *_), mean in zip(npy_read("disc.npy")[2], expected)]
            self.assertLess(max(map(abs, differences)), most)
            self.assertLess(abs(sum(differences)), 0.002 * sum(expected))

    def test_times(self):
        """Each time has its part of the samples, and one sample shows the frame. --set and --camera count."""
        process = self.glint(f"render moving.yaml {SIZE} --samples 1 -o one.npy", env=POCL)
        self.assertIn("warning: 'moving.yaml': 'shutter' has no effect at --samples 1", process.stderr)
        self.glint(f"render moving.yaml {SIZE} --samples 1 --set shutter=0 -o closed.npy", env=POCL)
        self.assertSameBytes("one.npy", "closed.npy")
        self.glint(f"render moving.yaml {SIZE} -o blurred.npy --aov t", env=POCL)
        self.assertGreater(self.furthest("blurred.npy", "one.npy"), 0.1)
        write("middle.yaml", SPHERE.replace("radius: 1", f"radius: {1 - 0.5 * 3.5 / 6}"))  # of six times the fourth
        self.glint(f"render middle.yaml {SIZE} -o middle.npy --aov t", env=POCL)
        self.assertSameBytes("blurred.t.npy", "middle.t.npy")
        write("still.yaml", SPHERE)
        write("orbit.yaml", "shutter: 1\nframes: 2\n" + SPHERE.replace("fov: 60", "fov: 60, turn: {keys: {0: 0, 1: 90}}"))
        self.glint(f"render orbit.yaml {SIZE} -o orbit.npy", env=POCL)
        self.glint(f"render still.yaml --camera orbit.yaml {SIZE} -o same.npy", env=POCL)
        self.assertSameBytes("orbit.npy", "same.npy")
        self.glint(f"render still.yaml --camera orbit.yaml --set shutter=0 {SIZE} -o closed.npy", env=POCL)
        self.assertGreater(self.furthest("closed.npy", "same.npy"), 0.01)

    def test_still(self):
        """If nothing moves the image is that without a shutter, with the same bits without keys, else within a rounding."""
        write("still.yaml", SPHERE)
        self.glint(f"render still.yaml {SIZE} -o still.npy", env=POCL)
        self.glint(f"render still.yaml {SIZE} --set shutter=1 -o open.npy", env=POCL)
        self.assertSameBytes("still.npy", "open.npy")
        write("equal.yaml", MOVING.replace("0.5", "1"))
        self.glint(f"render equal.yaml {SIZE} -o equal.npy", env=POCL)
        self.assertLess(self.furthest("equal.npy", "still.npy"), 3e-7)

    def test_strict(self):
        """Lanes, devices, a region and several frames change no bit."""
        strict = f"{SIZE} --precision strict"
        self.glint(f"render moving.yaml {strict} --lanes 1 -o one.npy", env=POCL)
        self.glint(f"render moving.yaml {strict} --device all -o two.npy", env=TWO)
        self.assertSameBytes("one.npy", "two.npy")
        self.glint(f"render moving.yaml {strict} --frames 0-1 --lanes 1 -o f%d.npy", env=POCL)
        self.assertSameBytes("one.npy", "f0.npy")
        self.assertGreater(self.furthest("f0.npy", "f1.npy"), 0.1)
        self.glint(f"render moving.yaml {strict} --region 8,6,16,10 --lanes 1 -o part.npy", env=POCL)
        whole, part = npy_read("one.npy")[2], npy_read("part.npy")[2]
        self.assertEqual(part, [whole[y * 32 + x] for y in range(6, 16) for x in range(8, 24)])

    def test_certified(self):
        """Pixels that are re-rendered in double show each time with its samples, and count once for each of these."""
        nearer = "  - sphere: {center: [0, 0, -1e-9], radius: {keys: {0: 1, 1: 0.5}}, material: {color: green}}\n"  # not at single
        write("twins.yaml", MOVING + nearer)
        report = self.json(f"render twins.yaml {SIZE} --precision certified -o certified.npy --timing=json", env=POCL)
        for precision in "single", "double":
            self.glint(f"render twins.yaml {SIZE} --precision {precision} -o {precision}.npy", env=POCL)
        self.assertGreater(self.furthest("single.npy", "double.npy"), 0.1)
        self.assertLess(self.furthest("certified.npy", "double.npy"), 1e-6)
        pixels = npy_read("double.npy")[2]
        hits = sum(color != pixels[0] for color in pixels)
        self.assertTrue(3 * hits < report["rerendered_samples"] < 9 * hits, (hits, report["rerendered_samples"]))
        self.assertLess(report["uncertified_samples"], hits / 10)
        device = report["by_device"][0]
        self.assertGreaterEqual(sum(launch["name"] == "render" for launch in device["launches"]), 6)
        self.assertGreaterEqual(device["bands"], 6)  # of each time

    def test_formats(self):
        """A PNG has the frame's number, an EXR its colors."""
        self.glint(f"render moving.yaml --frames 0 {SIZE} -o a.png", env=POCL)
        self.assertEqual(png_read("a.png")[2]["Frame"], "0")
        self.glint(f"render moving.yaml --frames 0 {SIZE} -o a.npy", env=POCL)
        self.glint(f"render moving.yaml --frames 0 {SIZE} -o a.exr", env=POCL)
        self.glint("diff a.npy a.exr --max-rmse 1e-3")

    def test_warnings(self):
        """Warnings are printed once, as are the files' names."""
        write("fine.yaml", MOVING + "  - sphere: {center: [0, 2, 0], radius: 1e-12}\n")
        process = self.glint(f"render fine.yaml {SIZE.replace('--quiet', '')} -o a.npy", env=POCL)
        self.assertEqual((process.stderr.count("trillionth"), process.stderr.count("wrote")), (1, 1), process.stderr)
        shine = "material: {transmission: 0.5, reflection: {keys: {0: 0.1, 1: 0.9}}}"  # together above 1 before it closes
        write("late.yaml", MOVING + f"  - sphere: {{center: [0, 2, 0], radius: 0.1, {shine}}}\n")
        process = self.glint(f"render late.yaml {SIZE} -o a.npy", env=POCL)
        self.assertEqual(process.stderr.count("warning"), 1, process.stderr)

    def test_refused(self):
        for options, reason in {"--checkpoint saved": "--checkpoint", "--max-error 0.1": "--max-error", "--alpha": "--alpha", "--aov backdrop": "--alpha or --aov"}.items():
            process = self.refuses(f"render moving.yaml {SIZE} {options} -o a.png", f"'moving.yaml': {reason} .*cannot be combined with an open shutter.* --set shutter=0 closes it", env=POCL)
            self.assertNotIn("wrote", process.stderr)
        self.refuses(f"render - {SIZE}", "standard input cannot be combined with an open shutter", input=MOVING, env=POCL)
        write("broken.yaml", MOVING.replace("1: 0.5", "1: -0.5"))  # at some of the times
        self.refuses(f"render broken.yaml {SIZE} -o a.npy", "'radius' must be greater than 0", env=POCL)
        self.assertFalse(os.path.exists("a.npy"))


if __name__ == "__main__":
    need_pocl()
    main()
