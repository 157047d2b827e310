#!/usr/bin/env -S python3 -B
"""Renders scenes in the manner of those that people keep, tests/wild/*.rt and *.cfg. Each must render or be refused as the file
SCENE.expected states. Its first line is one of
    refused          exit status 1, and no image
    renders          an image of more than one color
    renders blank    an image of one color
    renders as NAME  the image of the scene NAME, bit for bit
with --lenient at the end where that option is given. The other lines are all messages, in order:
LINE:COLUMN: error or warning: …"""
import re
from pathlib import Path

from glint import ROOT, TestCase, main, need_device, read, run, write

FOLDER = ROOT / "tests/wild"


def render(scene, options=""):
    """Renders a scene. Returns the finished process and the pixels of the image, or None if none was written."""
    image = Path("wild.ppm")
    image.unlink(missing_ok=True)
    process = run(f"render {scene} -o {image} --size 64x48 --quiet {options}")
    return process, image.read_bytes()[len("P6 64 48 255 "):] if image.exists() else None


def messages(errors, name):
    """Returns each message without the lines it quotes and the scene's path."""
    lines = (line for line in errors.splitlines() if re.search("(^|: )(error|warning): ", line))
    return [re.sub(rf"^(glint: ((error|warning): ))?\S*{re.escape(name)}: ?", r"\2", line) for line in lines]


def color_count(pixels):
    return len({pixels[i : i + 3] for i in range(0, len(pixels), 3)})


class Wild(TestCase):
    def check(self, scene):
        first, *expected = read(f"{scene}.expected").splitlines()
        outcome = first.removesuffix(" --lenient")
        process, pixels = render(scene, "" if outcome == first else "--lenient")
        self.assertEqual((process.returncode, process.stdout), (1 if outcome == "refused" else 0, ""))
        self.assertEqual(messages(process.stderr, scene.name), expected)
        if outcome == "refused":
            self.assertIsNone(pixels)
        elif outcome.startswith("renders as "):
            self.assertTrue(pixels == render(FOLDER / outcome.split()[2])[1], outcome)
        else:
            self.assertIn(outcome, ("renders", "renders blank"))
            self.assertEqual(color_count(pixels) == 1, outcome == "renders blank")

    def test_scenes(self):
        for scene in sorted(path for path in FOLDER.iterdir() if path.suffix != ".expected"):
            with self.subTest(scene.name):
                self.check(scene)

    def test_as_many_objects_as_the_largest_file_seen(self):
        lines = ["A 0.2 255,255,255", "C 0,60,-60 0,-0.6,0.8 70", "L -50,90,-50 0.8 255,255,255"]
        for i in range(11000):
            kind, size, blue = ("sp", "0.9", 90) if i % 2 else ("cy", "0,1,0 0.7 2", 160)
            lines.append(f"{kind} {i % 110 - 55},{i % 7 / 4},{i / 110 - 50} {size} {i % 256},{i // 43 % 256},{blue}")
        process, pixels = render(write("large.rt", "\n".join(lines) + "\n"))
        self.assertEqual(process.returncode, 0, process.stderr)
        self.assertGreater(color_count(pixels), 500)


if __name__ == "__main__":
    need_device()
    main()
