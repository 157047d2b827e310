#!/usr/bin/env -S python3 -B
"""Checks that the golden images of tests/golden keep their bits, and that the lines of glint golden find what changes, where,
and in which layer first.

run_tests: sanitize-long-only"""
import pathlib
import random
import re
import shutil

from glint import IS_LONG, ROOT, SPHERE, TestCase, main, png_read, read, shim_build, write

LINE = r"size=24x18 samples=1 bounces=5 scene=[0-9a-f]{16}( (object|t|normal|shadow|path|color)=[0-9a-f]{16}){6} tiles=[0-9a-f]{384} s\.yaml\n"

# Changes the lowest bit of word WORD of the MAP-th map of a device's results, or interrupts at the first.
SHIM = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <stdlib.h>

void *clEnqueueMapBuffer(void *queue, void *buffer, unsigned blocking, unsigned long long flags, size_t offset,
                         size_t size, unsigned count, const void *list, void *event, int *status)
{
    static long maps;
    if (maps == 0 && getenv("INTERRUPTS")) raise(SIGINT);
    unsigned *words = ((void *(*)())dlsym(RTLD_NEXT, "clEnqueueMapBuffer"))(queue, buffer, 1, flags, offset, size, count, list,
                                                                            event, status);
    if (words && maps++ == atol(getenv("MAP"))) words[atol(getenv("WORD")) % (size / 4)] ^= 1;
    return words;
}
"""


class Golden(TestCase):
    files = {"s.yaml": SPHERE}

    def written(self):
        self.glint("golden write s.yaml --size 24x18")
        return read("golden.txt")

    def test_images_of_the_repository(self):
        for scene in (ROOT / "tests/golden").glob("*.yaml"):
            shutil.copy(scene, ".")
        process = self.glint(f"golden check --file {ROOT}/tests/golden/golden.txt")
        self.assertEqual(process.stdout, "checkers.yaml: same\nhighlights.yaml: same\nshapes.yaml: same\n")

    def test_lines(self):
        """Each scene has a line with its name. Writing replaces it and keeps the others."""
        first = self.written()
        self.assertRegex(first, f"^(#.*\n)+{LINE}$")
        write("other scene.yaml", SPHERE.replace("radius: 1", "radius: 0.9"))
        self.glint("golden write 'other scene.yaml' --size 8x6 --samples 2 --bounces 0")
        self.glint("golden write s.yaml --size 24x18")
        both = read("golden.txt")
        self.assertTrue(both.startswith(first) and both.count("\n") == first.count("\n") + 1)
        self.assertEqual(self.glint("golden check").stdout, "s.yaml: same\nother scene.yaml: same\n")
        self.assertEqual(self.glint(f"golden check 'other scene.yaml' --lanes {'4 --bvh on' if IS_LONG else '1'}").stdout, "other scene.yaml: same\n")

    def test_differences(self):
        """For a changed scene, the first layer that differs and its pixels are printed, and a crop shows the current scene."""
        self.written()
        for change, layer, part in (
                (("radius: 1", "radius: 1.0000001"), "object|t", None), (("fov: 60", "fov: 61"), "object|t", None),
                (("[3, 4, -5]", "[-3, 4, -5]"), "color|shadow", None), (("[0.1, 0.2, 0.4]", "[0.1, 0.2, 0.5]"), "color", "x 0 to 23 and y 0 to 17")):
            with self.subTest(change):
                self.assertIn(change[0], SPHERE)
                write("s.yaml", SPHERE.replace(*change))
                out = self.glint("golden check", status=3).stdout
                found = re.fullmatch(r"s\.yaml: the scene has changed, and the image differs, first in (\w+); its color in (\d+) of 96 tiles, "
                                     r"at x (\d+) to (\d+) and y (\d+) to (\d+), written to s\.yaml-golden\.png\n", out)
                self.assertIsNotNone(found, out)
                self.assertRegex(found[1], f"^({layer})$")
                left, right, top, bottom = map(int, found.groups()[2:])
                self.assertEqual(png_read("s.yaml-golden.png")[0][:2], (right - left + 1, bottom - top + 1))
                if part:
                    self.assertIn(f"at {part}", out)

    def test_crop_of_display_values(self):
        """The colors of .rt scenes are those of the screen, without a transfer curve."""
        scene = "A 1 255,255,255\nC 0,0,0 0,0,1 60\nL 0,9,0 0 255,255,255\npl 0,0,5 0,0,-1 {}\n"
        write("wall.rt", scene.format("10,10,10"))
        self.glint("golden write wall.rt --size 24x16")
        write("wall.rt", scene.format("200,100,50"))
        self.glint("golden check", status=3)
        (width, height, *_), rows, *_ = png_read("wall.rt-golden.png")
        self.assertEqual(rows[1:4], bytes([200, 100, 50]), (width, height))

    def test_every_part_of_a_line_counts(self):
        """A changed digit of any layer's hash is reported as a difference of that layer, although the scene is the same."""
        line = self.written()
        for layer in "object", "t", "normal", "shadow", "path", "color":
            write("golden.txt", re.sub(rf"( {layer}=)(.)", lambda found: found[1] + "0123456789abcdef"[(int(found[2], 16) + 1) % 16], line))
            self.assertEqual(self.glint("golden check", status=3).stdout, f"s.yaml: the image differs, first in {layer}\n")

    def test_one_changed_bit_is_found(self):
        """The lowest bit of one number is changed, at a random place of each layer."""
        shim = shim_build("flip", SHIM)
        self.written()
        layers = {}
        chosen = random.Random(1)
        for i in range(1000 if IS_LONG else 12):
            env = {"LD_PRELOAD": shim, "MAP": str(i % 6), "WORD": str(chosen.randrange(1 << 30))}
            out = self.glint("golden check", status=3, env=env).stdout
            layers.setdefault(i % 6, set()).add(re.match(r"s\.yaml: the image differs, first in (\w+)", out)[1])
        self.assertEqual(sorted(map(list, layers.values())), [["color"], ["normal"], ["object"], ["path"], ["shadow"], ["t"]])

    def test_interrupt(self):
        env = {"LD_PRELOAD": shim_build("interrupt", SHIM), "MAP": "-1", "INTERRUPTS": "1"}
        self.assertEqual(self.glint("golden write s.yaml s.yaml --size 24x18", status=130, env=env).stderr, "glint: interrupted\n")
        self.nothing_left("golden.txt")

    def test_comments_and_line_ends(self):
        comments = "# mine\n#\n# of the layers' values\n"
        write("golden.txt", comments)
        self.assertEqual(self.written().count(comments), 1)
        self.assertEqual(self.written().count(comments), 1)
        write("golden.txt", read("golden.txt").replace("\n", "\r\n"))
        self.assertEqual(self.glint("golden check").stdout, "s.yaml: same\n")

    def test_scenes_of_one_name(self):
        for folder in "a", "b":
            pathlib.Path(folder).mkdir()
            write(f"{folder}/s.yaml", SPHERE)
        self.glint("golden write a/s.yaml b/s.yaml --size 24x18")
        for folder in "a", "b":
            write(f"{folder}/s.yaml", SPHERE.replace("radius: 1", "radius: 0.5"))
        out = self.glint("golden check", status=3).stdout
        self.assertRegex(out, r"(?s)a/s\.yaml.* to a-s\.yaml-golden\.png\nb/s\.yaml.* to b-s\.yaml-golden\.png\n")

    def test_reports(self):
        self.written()
        (scene,) = self.json("golden check --json")["scenes"]
        self.assertEqual((scene["scene"], scene["same"], scene["verdict"], scene["tiles"]), ("s.yaml", True, "same", 0))
        write("new.yaml", SPHERE)
        self.assertEqual(self.glint("golden check new.yaml", status=3).stdout, "new.yaml: golden.txt has no line for this scene; glint golden write adds it\n")
        (scene,) = self.json("golden check new.yaml --json", status=3)["scenes"]
        self.assertEqual((scene["same"], scene["verdict"], scene["first"]), (False, "no line", None))
        write("s.yaml", SPHERE.replace("radius: 1", "radius: 0.5"))
        out = self.glint("golden check --format csv", status=3).stdout.splitlines()
        self.assertRegex(out[1], r"^s\.yaml,another scene,object,\d+,\d+,\d+,\d+,\d+,s\.yaml-golden\.png$")

    def test_a_scene_that_cannot_be_read(self):
        """The other scenes are checked, and reported together with it."""
        self.written()
        write("golden.txt", read("golden.txt") + read("golden.txt").splitlines()[-1].replace("s.yaml", "missing.yaml") + "\n")
        process = self.glint("golden check missing.yaml s.yaml", status=1)
        self.assertEqual(process.stdout, "s.yaml: same\n")
        self.assertIn("missing.yaml", process.stderr)
        report = self.json("golden check missing.yaml s.yaml --json", status=1)
        self.assertEqual([(scene["scene"], scene["verdict"], scene["same"], scene["first"]) for scene in report["scenes"]],
                         [("missing.yaml", "not rendered", False, None), ("s.yaml", "same", True, None)])

    def test_refused(self):
        line = self.written()
        for wrong in "size=0x18" + line.split("size=24x18")[1], line.replace("tiles=", "tiles=g"), line.replace(" path=", " paths="), "x\n":
            write("golden.txt", wrong)
            self.refuses("golden check", r"golden\.txt:\d+:1: error: expected a line of glint golden write")
        for wrong in f"# a\0{'b' * 4000}\r\n", line.replace("s.yaml", "s.yaml\0"):
            write("golden.txt", wrong)
            self.refuses("golden check", r"golden\.txt:\d:1: error: the line has a NUL character")
        write("golden.txt", line + line.splitlines()[-1] + "\n")
        self.refuses("golden check", r'golden\.txt:4:1: error: a second line for "s\.yaml"')
        write("golden.txt", "# nothing\n")
        self.refuses("golden check", "'golden.txt' has no lines")
        self.refuses("golden check --size 8x6", "apply to write")
        self.refuses("golden check missing.yaml", "cannot read 'missing.yaml': No such file or directory")
        self.refuses("golden check --file missing.txt", "missing.txt")
        self.refuses("golden", "expected write or check")
        self.refuses("golden write", "no scene given")
        for option in "--format csv", "--output report.csv":
            self.refuses(f"golden write s.yaml {option}", "--format, --json and --output are for check")
        self.refuses("golden write missing.yaml --file new.txt", "missing.yaml")


if __name__ == "__main__":
    main()
