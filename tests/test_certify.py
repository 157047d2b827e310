#!/usr/bin/env -S python3 -B
"""Checks that glint certify notices errors and counts uncertified pixels. tests/test_certify.c has what needs no command.

run_tests: sanitize-long-only"""
import unittest

from glint import IS_LONG, ROOT, TestCase, main, need_device, npy_read, write

SMALL = "--size 96x64 --pixels 600"
STRONG = """\
camera: {position: [0, 0, -5], look_at: [0, 0, 0]}
lights: [{point: {position: [2, 5, -4], intensity: 1e30, color: [1e30, 1, 1]}}]
objects: [{sphere: {center: [0, 0, 0], radius: 1, material: {reflection: 0.5}}}]
"""  # beyond float
EDGE = """\
camera: {position: [0, 0, -5], look_at: [0, 0, 0]}
lights: [{point: {position: [2, 5, -4]}}]
objects:
  - triangle: {vertices: [[0, -1, 0], [0, 1.1, 0], [1, 0, 0]]}
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
TWINS = """\
camera: {position: [0, 0, -4], look_at: [0, 0, 0], fov: 30}
lights: [{point: {position: [3, 4, -5]}}]
objects:
  - sphere: {center: [0, 0, 0], radius: 1, material: {color: [1, 0, 0], reflection: 0.1}}
  - sphere: {center: [0, 0, -1e-9], radius: 1, material: {color: [0, 0, 1], reflection: 0.1}}
"""
# Fresnel's equations decide about glass, plastic seen against its normal, and a metal's tint next to them.
FRESNEL = """\
camera: {position: [0, 2, -6], look_at: [0, 0.7, 0], fov: 40}
background: [0.3, 0.5, 0.9]
lights: [{point: {position: [3, 5, -5], intensity: 20, falloff: inverse_square}}]
objects:
  - plane: {point: [0, 0, 0], normal: [0, -1, 0], material: {color: [0.5, 0.4, 0.3], reflection: 1, ior: 1.3, fresnel: true}}
  - sphere: {center: [-1, 1, 0], radius: 1, material: {diffuse: 0.1, transmission: 0.9, ior: 1.5, fresnel: true}}
  - box: {min: [0.4, 0, -0.5], max: [1.6, 1, 0.5], material: {diffuse: 0.1, reflection: [0.9, 0.7, 0.3]}}
"""
# What FRESNEL, METALS, ABSORPTION and FILTERS need together, far behind the eye, so that the same kernels serve all.
UNSEEN = """\
  - box: {min: [-900, -901, -901], max: [-899, -900, -900], material: {conductor: gold}}
  - box: {min: [-900, -901, -901], max: [-899, -900, -900], material: {transmission: 0.5, fresnel: true, emission: 0.1}}
  - sphere: {center: [-900, -900, -900], radius: 0.1, material: {transmission: [0.5, 0.4, 0.3], absorption: {color: 0.5}}}
"""
# Lights of which one fades to nothing before it reaches what is seen and one is dark.
FADED = ("lights: [{point: {position: [-900, -900, -900], intensity: 1e-9, falloff: inverse_square}}, "
         "{directional: {direction: [0, -1, 0], intensity: 0}}, ")
# Bodies that absorb: with a bubble and an opaque ball within, one below the horizon without end, and one around the eye.
ABSORPTION = """\
camera: {position: [0, 2, -6], look_at: [0, 0.7, 0], fov: 40}
background: [0.3, 0.5, 0.9]
lights: [{point: {position: [3, 5, -5]}}]
materials:
  red: {diffuse: 0.1, transmission: 0.9, ior: 1.5, absorption: {color: [1, 0.5, 0], distance: 2}, emission: [0, 0, 0.1]}
  air: {diffuse: 0.1, transmission: 0.9, ior: 0.7}
  sea: {diffuse: 0.1, transmission: 0.9, reflection: 0.1, ior: 1.3, absorption: {color: [0.5, 0.8, 0.9]}}
objects:
  - plane: {point: [0, 0, 0], normal: [0, 1, 0], material: sea}
  - sphere: {center: [-1, 1.3, 0], radius: 1, material: red}
  - sphere: {center: [-1.3, 1.3, 0], radius: 0.4, material: air}
  - sphere: {center: [-0.6, 1.3, 0.2], radius: 0.2}
  - sphere: {center: [1, -1, 0], radius: 0.8, material: {emission: 0.5}}
  - box: {min: [-9, -9, -9], max: [9, 9, 9], material: {transmission: 1, ior: 1, absorption: {color: 0.5, distance: 20}}}
"""
METALS = """\
camera: {position: [0, 2, -6], look_at: [0, 0.7, 0], fov: 40}
background: [0.3, 0.5, 0.9]
lights: [{point: {position: [3, 5, -5]}}]
objects:
  - plane: {point: [0, 0, 0], normal: [0, 1, 0], material: {conductor: {n: [1.5, 0.3, 2], k: [0, 1, 0.2]}, diffuse: 0.2}}
  - sphere: {center: [-1, 1.2, 0], radius: 1, material: {conductor: gold}}
  - box: {min: [0.4, 0.1, -0.5], max: [1.6, 1, 0.5], material: {conductor: aluminium, reflection: [0.9, 0.7, 0.3]}}
"""
# Filters one behind the other, with colored shadows, and total reflection.
FILTERS = """\
camera: {position: [0, 2, -6], look_at: [0, 0.7, 0], fov: 40}
background: [0.3, 0.5, 0.9]
lights: [{point: {position: [3, 5, -5]}}, {directional: {direction: [-1, -2, 0.5], color: [0.2, 0.3, 0.5]}}]
materials:
  red: {diffuse: 0.1, transmission: [0.9, 0.3, 0], ior: 1.5}
  cyan: {diffuse: 0.1, specular: [0.5, 0.2, 0], transmission: [0, 0.7, 0.9], ior: 1.3}
objects:
  - plane: {point: [0, 0, 0], normal: [0, 1, 0], material: {color: [0.5, 0.4, 0.3]}}
  - sphere: {center: [-1, 1.1, 0], radius: 1, material: red}
  - sphere: {center: [0.2, 2, -1], radius: 0.5, material: cyan}
  - box: {min: [0.5, 0.1, -0.5], max: [1.5, 1, 0.5], material: red}
"""
# What EDGE and MIRRORS need together, beyond what rays reach, so that the same kernels serve both.
BEHIND = """\
  - plane: {point: [0, 0, -900], normal: [0, 0, 1], material: {reflection: 0.5}}
  - disc: {center: [0, 0, -800], normal: [0, 0, 1], radius: 1, material: {checker: {colors: [[1, 1, 1], [0, 0, 0]], size: 0.5}}}
"""
OUTSIDE = "  - triangle: {vertices: [[0, -1, 90], [0, 1, 90], [1, 0, 90]]}\n"
HAS_DOUBLE = need_device()["fp64"]


class Certify(TestCase):
    def certify(self, scene, options):
        """Returns the rows by their precisions."""
        return {row["precision"]: row for row in self.json(f"certify {scene} {SMALL} --json {options}")["precisions"]}

    def test_errors_are_noticed(self):
        """Single cannot decide which of two spheres is nearer. A wrong pixel has a wrong color."""
        write("twins.yaml", TWINS)
        rows = self.certify("twins.yaml", "--precision single")
        wrong = rows["single"]["wrong"]
        self.assertGreater(wrong["object"], 5)
        self.assertGreater(rows["single"]["color"]["max_wrong"], 0.01)
        self.assertGreater(wrong["margin"], 0)

    def test_every_precision(self):
        """A precision that does not fit has a row with its reason, and is an error only if named. Here all but double, or all, are."""
        write("strong.yaml", STRONG)
        rows = self.certify("strong.yaml", "")
        self.assertEqual(list(rows), ["single", "strict", "double", "certified"])
        self.skip_if_refused(rows["double"].get("reason", ""))
        self.assertEqual([name for name, row in rows.items() if "wrong" in row], ["double"] if HAS_DOUBLE else [])
        for name, row in rows.items():
            if name != "double":
                self.assertEqual(row["status"], "unavailable")
                self.assertIn(name, row["reason"])
        self.assertEqual(self.glint(f"certify strong.yaml {SMALL}").stdout.count("unavailable: "), 4 - HAS_DOUBLE)
        self.refuses(f"certify strong.yaml {SMALL} --precision double,single", "single")

    def test_materials_without_bounds(self):
        """Neither a path nor a color differs from the exact ones, at all precisions that take these materials."""
        for scene in FRESNEL, METALS, ABSORPTION:
            self.write_unbounded(scene)
            precisions = "single,strict" + ",double" * HAS_DOUBLE if IS_LONG else "strict"
            for name, row in self.certify("scene.yaml", f"--precision {precisions}").items():
                self.assertEqual((row["wrong"]["path"], row["wrong"]["color"]), (0, 0), name)
                self.assertLess(row["color"]["max_right"], 1e-9 if name == "double" else 1e-3)

    @staticmethod
    def write_unbounded(scene):
        write("scene.yaml", scene if IS_LONG else scene.replace("lights: [", FADED) + UNSEEN)

    def certify_filters(self, options):
        """Returns the rows by their precisions. Only certified has the scene without UNSEEN, which it refuses."""
        self.write_unbounded(FILTERS)
        rows = self.certify("scene.yaml", f"--precision strict{',single' * IS_LONG}{',double' * (IS_LONG and HAS_DOUBLE)} {options}")
        write("filters.yaml", FILTERS)
        return rows | (self.certify("filters.yaml", f"--precision certified {options}") if HAS_DOUBLE else {})

    def test_filters(self):
        """Colored transmission has bounds, so that what is decided is right at every precision."""
        for name, row in self.certify_filters("").items():
            if name == "certified":
                self.assertEqual((row["wrong_certified"], row["uncertified"]["pixels"]), (0, 0))
            else:
                self.assertEqual((row["wrong"]["path"], row["wrong"]["color"]), (0, 0), name)
                self.assertLess(row["color"]["max_right"], 1e-9 if name == "double" else 1e-3)

    def test_min_contribution(self):
        """The limit ends the same paths in the reference. If it exceeds all weights, only camera rays remain."""
        self.write_unbounded(FILTERS)
        images = []
        for options in "", "--min-contribution 0", "--bounces 0", "--min-contribution 0.95", "--min-contribution 0.4":
            # at a precision whose kernel is built anyway
            self.glint(f"render scene.yaml {SMALL.split(' --pixels')[0]} --precision strict --quiet {options} -o a.npy")
            images.append(npy_read("a.npy")[2])
        self.assertEqual(images[0], images[1])
        self.assertEqual(images[2], images[3])
        self.assertNotIn(images[4], (images[0], images[2]))
        for name, row in self.certify_filters("--min-contribution 0.4 --bounces 8").items():
            wrong = row["wrong_certified"] if name == "certified" else row["wrong"]["path"] + row["wrong"]["color"]
            self.assertEqual(wrong, 0, name)
        for wrong in "2", "-1", "some", "nan":
            self.refuses(f"render scene.yaml --min-contribution={wrong}", "expected a number from 0 to 1")

    @unittest.skipUnless(HAS_DOUBLE, "no fp64")
    def test_parallel_mirrors(self):
        """Bounds grow by addition from one flat mirror to the next, so that 64 bounces are decided."""
        write("mirrors.yaml", MIRRORS if IS_LONG else MIRRORS + OUTSIDE)
        report = self.json("certify mirrors.yaml --size 24x16 --pixels 384 --bounces 64 --precision certified --json")
        row = report["precisions"][0]
        self.assertEqual((row["compared"], row["uncertified"]["pixels"], row["wrong_certified"]), (384, 0, 0))

    @unittest.skipUnless(HAS_DOUBLE, "no fp64")
    def test_uncertified_pixels(self):
        """Only pixels on an edge through the centers of a column are uncertified, where errors of double's size change the answer."""
        write("edge.yaml", EDGE if IS_LONG else EDGE + BEHIND)
        report = self.json("certify edge.yaml --size 33x33 --pixels 10000 --precision certified --json")
        row = report["precisions"][0]
        self.glint("render edge.yaml --size 33x33 --precision certified --quiet --aov flag -o edge.png")
        uncertified = [i for i, flag in enumerate(npy_read("edge.flag.npy")[2]) if flag == 2]
        count = len(uncertified)
        self.assertGreater(count, 10)
        self.assertEqual({i % 33 for i in uncertified}, {16})
        self.assertEqual(report["reference_uncertain"], count)
        self.assertEqual(row["uncertified"], {"pixels": count, "examined": count, "witnessed": count, "close": 0})
        self.assertEqual([row[name] for name in ("wrong_certified", "unconfirmed", "contradicted")], [0, 0, 0])

    def test_refused(self):
        for arguments, pattern in ((f"{ROOT}/scenes/demo.yaml --pixels 0", "--pixels"), ("", "no scene"), ("none.yaml", "none.yaml")):
            self.refuses(f"certify {arguments}", pattern)
        # a definition of 17,424 instances of bunny.obj's 3,872 triangles
        write("large.yaml", f"""\
camera: {{position: [0, 0, -5], look_at: [0, 0, 0]}}
define:
  bunny: {{objects: [{{mesh: {{file: {ROOT}/scenes/meshes/bunny.obj}}}}]}}
  row: {{objects: [{", ".join(["{instance: {of: bunny}}"] * 132)}]}}
objects: [{", ".join(["{instance: {of: row}}"] * 132)}]
""")
        self.refuses("certify large.yaml", "does not support more than 67,108,864 objects and triangles")
        self.refuses("render large.yaml --precision certified --size 8x8 -o x.png", "precision certified copies the mesh of each instance")


if __name__ == "__main__":
    main()
