#!/usr/bin/env -S python3 -B
"""glint certify: double decides as the reference does on every kind of scene, and errors are noticed. With
GLINT_LONG_TESTS=1 also on a mesh without other shapes.

run_tests: sanitize-long-only"""
import unittest

from glint import IS_LONG, PLANET, ROOT, TestCase, main, need_device, npy_read, write

SCENES = ["demo", "mirror-glass", "paraboloids"] + (["triangles"] if IS_LONG else [])
SMALL = "--size 96x64 --pixels 600"
STRONG = """\
camera: {position: [0, 0, -5], look_at: [0, 0, 0]}
lights: [{point: {position: [2, 5, -4], intensity: 1e30, color: [1e30, 1, 1]}}]
objects: [{sphere: {center: [0, 0, 0], radius: 1}}]
"""  # beyond float
EDGE = """\
camera: {position: [0, 0, -5], look_at: [0, 0, 0]}
lights: [{point: {position: [2, 5, -4]}}]
objects: [{triangle: {vertices: [[0, -1, 0], [0, 1.1, 0], [1, 0, 0]]}}]
"""
TILTED = """\
camera: {position: [0, 0, -5], look_at: [0, 0, 0]}
lights: [{point: {position: [8, 0, 2]}}, {point: {position: [3, 1, -4]}}]
objects:
  - triangle: {vertices: [[-2, -1, 0], [0, 2, 0], [2, -1, 0]], normals: [[3, 0, -1], [3, 1, -1], [1, 0, -1]], material: {reflection: 0.5}}
  - sphere: {center: [3, 0, 3], radius: 2}
"""
# A camera whose vectors rounding turns by a ten-thousandth, a blocker just before a light, and glass just above a floor.
NEAR = """\
camera: {position: [0.3, 2.1, -5], look_at: [1, 0.4, 0.7], up: [0.7, -1.7, 5.70000000005], fov: 50}
lights: [{point: {position: [1, 5, 0]}}, {point: {position: [-3, 4, -6]}}]
materials:
  tiles: {checker: {colors: [[1, 1, 1], [0.2, 0.2, 0.2]], size: 0.05}}
  glass: {transmission: 0.8, ior: 1.1}
objects:
  - plane: {point: [0, 0, 0], normal: [0.1, 1, 0.2], material: tiles}
  - disc: {center: [1, 4.999999999999, 0], normal: [0, 1, 0], radius: 1}
  - disc: {center: [0, 1e-10, 0], normal: [0.1, 1, 0.2], radius: 2, material: glass}
"""
# Rays run between parallel mirrors, some to a disc after dozens of bounces.
MIRRORS = """\
camera: {position: [0.1, 0.2, 0.3], look_at: [3, 0.1, 2], fov: 40}
ambient: [0.5, 0.5, 0.5]
lights: [{point: {position: [0.5, 1, 0.2]}}]
materials:
  mirror: {reflection: 0.95, diffuse: 0.1}
  tiles: {checker: {colors: [[0.8, 0.8, 0.8], [0.4, 0.4, 0.4]], size: 0.5}}
objects:
  - plane: {point: [0, 0, 1], normal: [0.1, 0.2, 1], material: mirror}
  - plane: {point: [0, 0, -1], normal: [0.1, 0.2, 1], material: mirror}
  - disc: {center: [30, 0, -3], normal: [1, 0, 0], radius: 1, material: tiles}
"""
HAS_DOUBLE = need_device()["fp64"]


ARTICLE = f"{ROOT}/scenes/article.yaml"


def at_the_edge_of_the_cone(article):
    """The article's scene through a longer lens."""
    with open(article) as file:
        text = file.read()
    seen = text.replace("look_at: [0, 1.05, 0], focal_length: 2,", "look_at: [-1.6947, 1.4227, 0.2414], focal_length: 60,")
    assert seen != text
    return seen


class Certify(TestCase):
    def certify(self, scene, options):
        report = self.json(f"certify {scene} {SMALL} --json {options}")
        return report, {row["precision"]: row for row in report["precisions"]}

    def test_the_best_precision_is_right(self):
        """In scenes of every shape, light and kind of bounce. The largest error of double is 3e-12."""
        best = "double" if HAS_DOUBLE else "strict"
        for name in SCENES:
            with self.subTest(name):
                report, rows = self.certify(f"{ROOT}/scenes/{name}.yaml", f"--precision {best}")
                self.assertEqual(list(rows), [best])
                wrong = rows[best]["wrong"]
                self.assertLessEqual(sum(wrong[kind] for kind in ("object", "shadow", "path", "color")), 0 if HAS_DOUBLE else 2)
                self.assertLess(report["reference_undecided"], report["pixels"] / 10)
                self.assertEqual(rows[best]["compared"], report["pixels"] - report["reference_undecided"])
                if HAS_DOUBLE:
                    self.assertLess(rows[best]["color"]["max_right"], 1e-10)

    @unittest.skipUnless(HAS_DOUBLE, "no fp64")
    def test_tilted_normals(self):
        """By a smooth triangle's normals the reflected ray would run through it, and a light behind it shine on it."""
        write("tilted.yaml", TILTED)
        _, rows = self.certify("tilted.yaml", "--precision double,certified")
        for row in rows.values():
            self.assertEqual([row["wrong"][name] for name in ("object", "shadow", "path", "color")], [0, 0, 0, 0])
        self.assertLess(rows["double"]["color"]["max_right"], 1e-10)

    @unittest.skipUnless(HAS_DOUBLE, "no fp64")
    def test_colors_of_certified(self):
        """They are as exact as those of single, even at the edges of round shapes."""
        write("edge-of-a-cone.yaml", at_the_edge_of_the_cone(ARTICLE))
        for options in ["edge-of-a-cone.yaml --size 96x64 --pixels 6144"] + IS_LONG * [f"{ARTICLE} --size 640x360 --pixels 230400"]:
            report = self.json(f"certify {options} --precision single,certified --json")
            self.assertEqual([row["wrong"]["color"] for row in report["precisions"]], [0, 0])
            single, certified = (row["color"]["max_right"] for row in report["precisions"])
            self.assertLessEqual(certified, 2 * single)

    def test_errors_are_noticed(self):
        """A planet at fast loses the shadow of a small sphere; a wrong pixel has a wrong color."""
        write("planet.yaml", PLANET)
        _, rows = self.certify("planet.yaml", "--precision fast")
        wrong = rows["fast"]["wrong"]
        self.assertGreater(wrong["object"] + wrong["shadow"], 5)
        self.assertGreater(rows["fast"]["color"]["max_wrong"], 0.01)
        self.assertGreater(wrong["margin"], 0)

    def test_every_precision(self):
        """What does not fit is a row with its reason, and an error only if it is named: here all but double, or all."""
        write("strong.yaml", STRONG)
        _, rows = self.certify("strong.yaml", "")
        self.assertEqual(list(rows), ["fast", "single", "strict", "double", "certified"])
        self.assertEqual([name for name, row in rows.items() if "wrong" in row], ["double"] if HAS_DOUBLE else [])
        for name, row in rows.items():
            if name != "double":
                self.assertEqual(row["status"], "unavailable")
                self.assertIn(name, row["reason"])
        self.assertEqual(self.glint(f"certify strong.yaml {SMALL}").stdout.count("unavailable: "), 5 - HAS_DOUBLE)
        self.refuses(f"certify strong.yaml {SMALL} --precision double,single", "single")

    @unittest.skipUnless(HAS_DOUBLE, "no fp64")
    def test_no_false_alarms(self):
        """The reference starts from the vectors of double, and neither skips nor joins surfaces that are close to each other."""
        write("near.yaml", NEAR)
        report = self.json("certify near.yaml --size 96x64 --pixels 6144 --precision certified --json")
        row = report["precisions"][0]
        self.assertEqual([row[name] for name in ("wrong_decided", "unconfirmed", "contradicted")], [0, 0, 0])
        self.assertGreater(row["compared"], 6000)
        self.assertLess(row["undecided"]["pixels"], 600)

    @unittest.skipUnless(HAS_DOUBLE, "no fp64")
    def test_parallel_mirrors(self):
        """Bounds grow by addition from one flat mirror to the next, so that 64 bounces are decided."""
        write("mirrors.yaml", MIRRORS)
        report = self.json("certify mirrors.yaml --size 24x16 --pixels 384 --bounces 64 --precision certified --json")
        row = report["precisions"][0]
        self.assertEqual((row["compared"], row["undecided"]["pixels"], row["wrong_decided"]), (384, 0, 0))

    @unittest.skipUnless(HAS_DOUBLE, "no fp64")
    def test_undecided_pixels(self):
        """They are those on an edge through the centers of a column, where errors of double's size change the answer."""
        write("edge.yaml", EDGE)
        report = self.json("certify edge.yaml --size 33x33 --pixels 10000 --precision certified --json")
        row = report["precisions"][0]
        self.glint("render edge.yaml --size 33x33 --precision certified --quiet --aov doubt -o edge.png")
        undecided = [i for i, doubt in enumerate(npy_read("edge.doubt.npy")[2]) if doubt == 2]
        count = len(undecided)
        self.assertGreater(count, 10)
        self.assertEqual({i % 33 for i in undecided}, {16})
        self.assertEqual(report["reference_undecided"], count)
        self.assertEqual(row["undecided"], {"pixels": count, "examined": count, "witnessed": count, "close": 0})
        self.assertEqual([row[name] for name in ("wrong_decided", "unconfirmed", "contradicted")], [0, 0, 0])

    def test_refused(self):
        for arguments, pattern in ((f"{ROOT}/scenes/demo.yaml --pixels 0", "--pixels"), ("", "no scene"), ("none.yaml", "none.yaml")):
            self.refuses(f"certify {arguments}", pattern)


if __name__ == "__main__":
    main()
