#!/usr/bin/env -S python3 -B
"""Renders scenes in the manner of those that people keep, tests/wild.txt. Each must render, or be refused, as its name ends:
    refused          exit status 1, and no image
    renders          an image of more than one color
    renders blank    an image of one color
    renders as NAME  the image of the scene NAME, bit for bit
with --lenient at the end where that option is given. The messages below it are all that it gets, in order."""
from pathlib import Path

from glint import ROOT, TestCase, main, need_device, run, write
from scene_tables import messages_about, messages_in, scenes


def render(scene, options=""):
    """Renders a scene. Returns the finished process and the pixels of the image, or None if none was written."""
    image = Path("wild.ppm")
    image.unlink(missing_ok=True)
    process = run(f"render {scene} -o {image} --size 64x48 --quiet {options}")
    return process, image.read_bytes()[len("P6 64 48 255 "):] if image.exists() else None


def color_count(pixels):
    return len({pixels[i : i + 3] for i in range(0, len(pixels), 3)})


class Wild(TestCase):
    def test_scenes(self):
        images = {}
        for scene in scenes(ROOT / "tests/wild.txt"):
            name, outcome = scene.name.split(": ")
            Path(name).write_bytes(scene.content)
            with self.subTest(name):
                process, pixels = images[name] = render(name, "--lenient" if "--lenient" in outcome else "")
                outcome = outcome.removesuffix(" --lenient")
                self.assertEqual((process.returncode, process.stdout), (1 if outcome == "refused" else 0, ""))
                self.assertEqual(messages_in(process.stderr), messages_about(name, scene))
                if outcome == "refused":
                    self.assertIsNone(pixels)
                elif outcome.startswith("renders as "):
                    self.assertTrue(pixels == images[outcome.split()[2]][1], outcome)
                else:
                    self.assertIn(outcome, ("renders", "renders blank"))
                    self.assertEqual(color_count(pixels) == 1, outcome == "renders blank")
        self.assertGreater(len(images), 50)

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
