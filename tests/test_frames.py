#!/usr/bin/env -S python3 -B
"""Checks that each frame of an animation is the image of the scene with that frame's values."""
import json
import math
import os
from pathlib import Path

import glint
from glint import SPHERE, TestCase, main, need_device, npy_read, png_read, read, write

# with the features of SPHERE
SCENE = """
camera: {{position: [0, 1, 6], look_at: [0, 0, 0], fov: {fov}}}
ambient: 0.3
lights: [{{point: {{position: {light}, intensity: {intensity}}}}}]
objects:
  - sphere: {{center: [0, 0, 0], radius: {radius}, material: {{color: red, reflection: 0.1}}}}
  - sphere: {{center: [1.5, 0.5, 0.5], radius: 0.5, transform: {{rotate: {turn}}}}}
"""
KEYS = {"fov": "{keys: {2: 40, 6: 50}}", "light": "{keys: {0: [4, 4, 4], 4: [-4, 4, 4], 8: [4, 4, 4]}}",
        "intensity": "{keys: {0: 1, 8: 0}, ease: smooth}", "radius": "{keys: {0: 1, 3: 0.5, 6: 0.75}, ease: step}",
        "turn": "{keys: {0: [0, 0, 0], 8: [0, 90, 0]}}"}
RENDER = "--size 32x18 --quiet"


class Frames(TestCase):
    def test_values(self):
        """Values are right before the first key, at keys, between them and after the last."""
        write("moving.yaml", SCENE.format(**KEYS))
        self.glint(f"render moving.yaml --frames 0-9 {RENDER} -o f%d.npy")
        for frame, values in {
            0: ("40", "[4, 4, 4]", "1", "1", "[0, 0, 0]"),
            2: ("40", "[0, 4, 4]", "0.84375", "1", "[0, 22.5, 0]"),
            3: ("42.5", "[-2, 4, 4]", "0.68359375", "0.5", "[0, 33.75, 0]"),
            5: ("47.5", "[-2, 4, 4]", "0.31640625", "0.5", "[0, 56.25, 0]"),
            6: ("50", "[0, 4, 4]", "0.15625", "0.75", "[0, 67.5, 0]"),
            9: ("50", "[4, 4, 4]", "0", "0.75", "[0, 90, 0]"),
        }.items():
            with self.subTest(frame):
                fixed = dict(zip(("fov", "light", "intensity", "radius", "turn"), values))
                write("fixed.yaml", SCENE.format(**fixed))
                self.glint(f"render fixed.yaml {RENDER} -o fixed.npy")
                self.assertSameBytes(f"f{frame}.npy", "fixed.npy")
        self.assertNotEqual(npy_read("f4.npy"), npy_read("f5.npy"))

    def test_turn(self):
        """The camera goes round the point that it looks at, about `up`, in equal steps and back to where it was."""
        scene = ("camera: {{position: {position}, look_at: [1, 2, 3], up: [0, 0, 2]{turn}}}\n"
                 "lights: [{{point: {{position: [9, 8, 7]}}}}]\n"
                 "objects: [{{sphere: {{center: [1, 2, 3], radius: 1, material: {{reflection: 0.1}}}}}}, {{sphere: {{center: [2, 1, 3.5], radius: 0.5}}}}]\n")
        write("moving.yaml", scene.format(position="[1, -4, 5]", turn=", turn: {keys: {0: 0, 12: 360}}"))
        self.glint(f"render moving.yaml --frames 0-12 {RENDER} --precision double --aov t -o f%02d.npy")
        for frame in range(13):
            angle = math.radians(30 * frame)
            position = [1 + 6 * math.sin(angle), 2 - 6 * math.cos(angle), 5]
            write("fixed.yaml", scene.format(position=position, turn=""))
            self.glint(f"render fixed.yaml {RENDER} --precision double --aov t -o fixed.npy")
            for a, b in zip(npy_read(f"f{frame:02}.t.npy")[2], npy_read("fixed.t.npy")[2]):
                self.assertTrue(a == b or abs(a - b) < 1e-9, (frame, a, b))
        self.assertSameBytes("f00.npy", "f12.npy")
        self.assertNotEqual(npy_read("f00.npy"), npy_read("f01.npy"))

    def test_all(self):
        """The scene, or else the file of --camera, defines the number of frames."""
        moving = SCENE.format(**KEYS)
        write("moving.yaml", f"frames: 3\n{moving}")
        write("still.yaml", SPHERE)
        for options, count in ("moving.yaml --frames all", 3), ("still.yaml --camera moving.yaml --frames all", 3), \
                ("moving.yaml --set frames=2 --frames all", 2), ("moving.yaml --frames all --frames 1", 1), \
                ("moving.yaml --frames 1-2 --frames all", 3):
            with self.subTest(options):
                self.glint(f"render {options} {RENDER} -o all%d.ppm")
                names = sorted(Path().glob("all*.ppm"))
                self.assertEqual(len(names), count)
                self.assertEqual(names[0].name, "all1.ppm" if options.endswith(" 1") else "all0.ppm")
                for name in names:
                    name.unlink()

    def test_rate(self):
        """`glint check` prints the number of frames and their rate, from the file of --camera unless the scene has them."""
        write("shot.yaml", SPHERE + "frames: 48\nfps: 12.5\n")
        write("slow.yaml", SPHERE + "fps: 2\n")
        self.assertIn("\n  frames     48\n  fps        12.5\n", self.glint("check shot.yaml").stdout)
        for name, rate in ("sphere.yaml", 12.5), ("slow.yaml", 2):
            write("sphere.yaml", SPHERE)
            scene = self.json(f"check {name} --camera shot.yaml --json")
            self.assertEqual((scene["frames"], scene["fps"]), (48, rate))

    def test_names(self):
        write("moving.yaml", SCENE.format(**KEYS))
        os.makedirs("a%d", exist_ok=True)
        os.makedirs("out", exist_ok=True)
        for option, names in (("", ["moving-0007.png", "moving-0008.png"]), ("-o a%d/x%03dy.png", ["a%d/x007y.png", "a%d/x008y.png"]),
                              ("-o z%d.exr", ["z7.exr", "z8.exr"]), ("-o 100%-%d.png", ["100%-7.png", "100%-8.png"]),
                              ("-o out", ["out/moving-0007.png", "out/moving-0008.png"])):
            with self.subTest(option):
                self.glint(f"render moving.yaml --frames 7-8 {RENDER} {option}")
                for name in names:
                    self.assertTrue(os.path.exists(name), name)
        self.assertEqual(png_read("moving-0007.png")[2]["Frame"], "7")
        self.glint(f"render moving.yaml --frames 3 {RENDER} -o one.png")
        self.assertEqual(png_read("one.png")[2]["Frame"], "3")
        self.assertNotIn("Frame", png_read(self.still())[2])

    def still(self):
        write("still.yaml", SPHERE)
        self.glint(f"render still.yaml {RENDER} -o still.png")
        return "still.png"

    def test_skip_existing(self):
        """Existing images of frames and of scenes are kept."""
        write("moving.yaml", SCENE.format(**KEYS))
        write("s1.png", "kept")
        process = self.glint("render moving.yaml --frames 0-2 --size 32x18 --skip-existing -o s%d.png")
        self.assertEqual(process.stderr, "glint: wrote s0.png\nglint: kept s1.png\nglint: wrote s2.png\n")
        self.assertEqual(read("s1.png"), "kept")
        write("still.yaml", SPHERE)
        write("still.png", "kept")
        process = self.glint("render moving.yaml still.yaml --size 32x18 --skip-existing")
        self.assertEqual((process.stderr, read("still.png")), ("glint: wrote moving.png\nglint: kept still.png\n", "kept"))
        # its AOV does not exist
        process = self.glint("render moving.yaml --size 32x18 --skip-existing --aov t")
        self.assertEqual(process.stderr, "glint: wrote moving.png, moving.t.npy\n")
        # a scene without lights has no file of shadows
        write("dark.yaml", SPHERE.splitlines()[0])
        for verb in "wrote", "kept":
            process = self.glint("render dark.yaml --size 32x18 --skip-existing --aov shadow,t")
            self.assertRegex(process.stderr, f"glint: {verb} dark.png")
        self.refuses("render moving.yaml --skip-existing --timing=json", "nothing to report")

    def test_reports(self):
        """Each frame and each scene has one line."""
        write("moving.yaml", SCENE.format(**KEYS))
        write("still.yaml", SPHERE)
        for options, expected in ("moving.yaml --frames 3-4", [("moving.yaml", 3), ("moving.yaml", 4)]), \
                ("moving.yaml still.yaml", [("moving.yaml", None), ("still.yaml", None)]):
            lines = self.glint(f"render {options} {RENDER} --timing=json").stdout.splitlines()
            reports = [json.loads(line) for line in lines]
            self.assertEqual([(report["scene"], report.get("frame")) for report in reports], expected)
            self.assertTrue(all(report["by_device"][0]["launches"] for report in reports))
        self.assertEqual(self.json(f"render moving.yaml --frames 3 {RENDER} --timing=json")["frame"], 3)

    def test_standard_streams(self):
        """A scene is read from standard input. Images on standard output follow each other, with the bytes of files."""
        moving = SCENE.format(**KEYS)
        write("moving.yaml", moving)
        for ending in "png", "ppm", "npy":
            self.glint(f"render moving.yaml --frames 0-2 {RENDER} -o f%d.{ending}")
            files = b"".join(Path(f"f{frame}.{ending}").read_bytes() for frame in range(3))
            for scene, text in ("moving.yaml", None), ("-", moving.encode()):
                frames = range(3) if scene == "-" else ["0-2"]  # standard input is read once
                outputs = [glint.run(f"render {scene} --frames {frame} {RENDER} -o - --format {ending}", text=False,
                                     **({"input": text} if text else {})) for frame in frames]
                self.assertEqual([output.returncode for output in outputs], [0] * len(outputs), outputs)
                written = b"".join(output.stdout for output in outputs)
                if ending == "png" and text:  # a PNG names its scene
                    written = b"".join(written.split(b"Scene\0-"))
                    self.assertEqual(written.count(b"IHDR"), 3)
                else:
                    self.assertEqual(written, files)
        self.glint(f"render - {RENDER}", input=moving)
        self.assertTrue(os.path.exists("image.png"))
        self.refuses("render -", r"-:1:1: error: .*'ball'", input="ball: {}")
        for options, reason in {"-o -": "needs --format", "--format png": "is for --output -", "-o - --format exr": "expected png",
                                "-o - --format png --aov t": "several files", "-o - --format png --skip-existing": "is for files", "-o - --format png --timing=json": "where --output - writes",
                                "-o - --format npy --dither": "linear values"}.items():
            self.refuses(f"render moving.yaml {options}", reason)
        for size in "8x8", "512x512":  # one whose bytes wait in a buffer, and one that fails while it is rendered
            with open("/dev/full", "w") as device:
                full = glint.run(f"render moving.yaml --frames 0-99 --quiet --size {size} -o - --format ppm", stdout=device)
            self.assertEqual((full.returncode, full.stderr.count("standard output")), (2, 1), full.stderr)

    def test_refused(self):
        write("moving.yaml", SCENE.format(**KEYS))
        write("still.yaml", SPHERE)
        for options, message in {
            "--frames 0-3 -o a.png": "or have a place for the number, such as image-%04d.png",
            "--frames 0-3 -o %d/a.png": "or have a place for the number",
            "--frames 0-3 -o %5d.png": "or have a place for the number",
            "--frames 0-3 -o %d-%02d.png": "more than one place",
            "--frames 3-2": "--frames: expected all, or A or A-B",
            "--frames -1": "--frames: expected all, or A or A-B",
            "--frames 1x": "--frames: expected all, or A or A-B",
            "--frames 0-3 -o a-%d.jpg": r"\Aglint render: .*\.png, \.ppm, \.exr or \.npy.*\n\Z",
            "--frames 0-1000000": "--frames: expected all, or A or A-B",
            "--frames all": "--frames all needs 'frames' in 'moving.yaml'; or give a range, such as --frames 0-47",
            "--frames all -o a.png": "or have a place for the number",
            "--frames 0-3 still.yaml": "--frames takes one scene",
            "--frames 0-3 --checkpoint c-%d": "--checkpoint of several frames needs --skip-existing",
            "--frames 0-3 --checkpoint c --skip-existing": "must have a place for the number, such as bands-%04d",
            "--frames 0-3 --timing=trace": "--timing=trace takes one image",
        }.items():
            self.refuses(f"render moving.yaml {RENDER} {options}", message)
        self.refuses("render - --frames 0-1", "standard input only once")
        for frames in "0-1", "7":
            process = self.glint(f"render still.yaml --frames {frames} {RENDER}")
            self.assertEqual(process.stderr, "glint: warning: 'still.yaml' has no keys: all frames are alike\n")
        # neither replaced nor removed values count
        for value in "camera.fov=40", "camera.fov=":
            write("moving.yaml", "camera: {position: [0, 0, 5], look_at: [0, 0, 0], fov: {keys: {0: 1, x: 2}}}\nobjects: []\n")
            self.assertIn("has no keys", self.glint(f"render moving.yaml --frames 1 --set {value} {RENDER}").stderr)


if __name__ == "__main__":
    if not glint.IS_SANITIZED:
        need_device()
    main()
