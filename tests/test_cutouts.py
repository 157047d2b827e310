#!/usr/bin/env -S python3 -B
"""Checks that camera rays, shadow rays, mirrored rays and explicit rays pass where the alpha of an image is low, as if the holes
were cut into the shape. Also tests what formats of meshes make of alpha.

run_tests: sanitize-long-only"""
import math

from glint import IS_LONG, TestCase, csv_rows, main, need_device, npy_read, png_bytes, write
from mesh_files import WHOLE, Gltf

HAS_DOUBLE = need_device()["fp64"]
PRECISIONS = ["single", "strict"] + ["double"] * HAS_DOUBLE if IS_LONG else ["strict"]
QUAD = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
HOLE, TEXELS = 0.6, 64  # the hole's radius on the quad, whose side is 2


def png(path, alphas, color=6):
    """Writes an 8-bit image of one color with an alpha for each pixel, or a gray image of these values. Returns its path."""
    pixel = (lambda a: bytes([200, 100, 50, round(255 * a)])) if color == 6 else (lambda a: bytes([round(255 * a)]))
    write_bytes(path, png_bytes([b"".join(map(pixel, row)) for row in alphas], color))
    return path


def hole_png(path, color=6):
    """Writes an image with a round hole. Alpha is linear between texels, so the edge at 0.5 is within a fraction of a texel."""
    places = [(i + 0.5) / TEXELS * 2 - 1 for i in range(TEXELS)]
    return png(path, [[min(max(0.5 + (math.hypot(x, y) - HOLE) * 8, 0), 1) for x in places] for y in places], color)


HALF = [[0, 0, 1, 1]]  # the left half is cut out
# Out of sight, so that the same kernels serve scenes with and without holes and glass.
UNSEEN = "mesh: {file: quad.obj, material: {image: hole.png, cutout: 0.5, transmission: 0.5}, transform: {translate: [0, 0, 900]}}"


class Cutouts(TestCase):
    def setUp(self):
        super().setUp()
        write("quad.obj", QUAD)
        hole_png("hole.png")
        png("half.png", HALF)

    def layers(self, scene, options, *names):
        self.glint(f"render {scene} -o a.npy --quiet {options} --aov {','.join(names)}")
        return [npy_read(f"a.{name}.npy")[2] for name in names]

    def hits(self, scene, rays, options=""):
        """Returns the object and t of each ray (origin, direction), or None."""
        write("rays.txt", "".join(" ".join(map(str, [*origin, *direction])) + "\n" for origin, direction in rays))
        head, rows = csv_rows(self.glint(f"trace {scene} --rays rays.txt {options}").stdout)
        return [None if row[head.index("object")] is None else (row[head.index("object")], row[head.index("t")]) for row in rows]

    def test_a_hole_lets_light_through(self):
        """Each place on the floor is in shadow if its line to a light crosses the square outside of the hole."""
        write(
            "scene.yaml",
            "camera: {position: [0, 1.7, -5], look_at: [0.2, 0, 0], fov: 40}\n"
            "lights: [{point: {position: [0.4, 5, 0.3]}}, {directional: {direction: [0.3, -1, 0.2]}},\n"
            "  {spot: {position: [-1, 4, 0], look_at: [0, 2, 0], angle: 80}}]\n"
            "objects: [{plane: {point: [0, 0, 0], normal: [0, 1, 0]}},\n"
            "  {mesh: {file: quad.obj, material: {image: hole.png, cutout: 0.5}, transform: [{rotate: [-90, 0, 0]}, {translate: [0, 2, 0]}]}}]\n",
        )
        lanes = [1, 4, 8, 16] if IS_LONG else []  # which test_textures compares
        for options in [f"--precision {p}" for p in PRECISIONS] + [f"--lanes {lane}" for lane in lanes]:
            objects, positions, shadows = self.layers("scene.yaml", f"--size 96x64 {options}", "object", "position", "shadow")
            counts = [[0, 0, 0] for _ in range(3)]
            for seen, (x, y, z), shadow in zip(objects, positions, shadows):
                if seen != 0:
                    continue
                for light, ((lx, ly, lz), is_shadowed) in enumerate(zip([(0.4, 5, 0.3), (x - 0.3e6, 1e6, z - 0.2e6), (-1, 4, 0)], shadow)):
                    part = (2 - y) / (ly - y)
                    cx, cz = x + part * (lx - x), z + part * (lz - z)
                    outside, radius = max(abs(cx), abs(cz)), math.hypot(cx, cz)
                    if abs(outside - 1) < 0.01 or abs(radius - HOLE) < 1 / TEXELS or (light == 2 and is_shadowed and outside > 1):
                        continue
                    place = 0 if outside > 1 else 1 if radius > HOLE else 2
                    counts[light][place] += 1
                    self.assertEqual(is_shadowed, int(place == 1), f"{options}: light {light} at {x}, {z}")
            for light in counts:
                self.assertGreater(min(light), 50, f"{options}: {counts}")

    def test_layers_next_to_each_other(self):
        """Behind a hole the very next layer is seen, a millionth behind or in the same place, and behind two holes the third."""
        layer = "  - mesh: {{file: quad.obj, material: {{image: {}.png, cutout: 0.5}}, transform: {{translate: [0, 0, {}]}}}}\n"
        png("right.png", [[1, 1, 0, 0]])
        png("top.png", [[1], [1], [0], [0]])
        for gap in 1e-6, 0:
            layers = [layer.format(name, 1 + i * gap) for i, name in enumerate(["half", "top", "right"])]
            write("scene.yaml", "camera: {position: [0, 0, -1], look_at: [0, 0, 0]}\nobjects:\n" + "".join(layers))
            for precision in PRECISIONS:
                places = [(x, y) for x in (-0.7, 0.7) for y in (-0.7, 0.7)]
                hits = self.hits("scene.yaml", [((x, y, 0), (0, 0, 1)) for x, y in places], f"--precision {precision}")
                for (x, y), (triangle, t) in zip(places, hits):
                    expected = 0 if x > 0 else 1 if y > 0 else 2
                    self.assertEqual(triangle // 2, expected, f"{gap} {precision} {x} {y}")
                    self.assertLess(abs(t - 1 - expected * gap), 1.2e-7, f"{gap} {precision} {x} {y}")
            # lights in front reach all that is seen; the shapes and lights of the test above share its kernels
            lights = "directional: {direction: [0.3, -0.2, 1]}", "point: {position: [0.2, 0.1, -9]}", "spot: {position: [0, 0, -9], look_at: [0, 0, 0], angle: 40}"
            head = f"camera: {{position: [0, 0, -4], look_at: [0, 0, 0], fov: 20}}\nlights: [{', '.join(f'{{{light}}}' for light in lights)}]\nobjects:\n"
            write("lit.yaml", head + "".join(layers) + "  - plane: {point: [0, 0, 9], normal: [0, 0, 1]}\n")
            for precision in PRECISIONS:
                objects, shadows = self.layers("lit.yaml", f"--size 32x32 --precision {precision}", "object", "shadow")
                self.assertEqual({triangle // 2 for triangle in objects}, {0, 1, 2}, f"{gap} {precision}")
                self.assertEqual(sum(shadow != (0, 0, 0) for shadow in shadows), 0, f"{gap} {precision}")

    def test_each_shape(self):
        """Explicit rays pass holes of a plane and a disc, and hit a sphere's far side, or nothing if that has a hole."""
        write(
            "scene.yaml",
            "camera: {position: [0, 0, -1], look_at: [0, 0, 0]}\n"
            "materials: {half: {image: half.png, cutout: 0.5, size: 2}}\n"
            "objects: [{sphere: {center: [0, 0, 0], radius: 1, material: half}},\n"
            "  {sphere: {center: [5, 0, 0], radius: 1, material: {image: half.png, cutout: 0.5, transmission: 0.5}}},\n"
            "  {plane: {point: [0, 0, 9], normal: [0, 0, 1], material: half}},\n"
            "  {disc: {center: [0, 0, -9], normal: [0, 0, 1], radius: 1.5, material: half}}]\n",
        )
        rays = [
            ((-5, 0, 0.1), (1, 0, 0)), ((3, 0, 0.1), (-1, 0, 0)), ((0, 0, 0), (-1, 0, 0)), ((0, 0, 0), (1, 0, 0)), ((2, 0.5, 0), (1, 0, 0)), ((7, 0.5, 0), (-1, 0, 0)),
            ((0.5, 3, 5), (0, 0, 1)), ((1.5, 3, 5), (0, 0, 1)), ((-0.5, 0, -5), (0, 0, -1)), ((0.5, 0, -5), (0, 0, -1)), ((0.5, 3, 30), (0, 0, -1)),
        ]  # fmt: skip
        root = math.sqrt(0.99)
        side = math.sqrt(0.75)
        expected = [(0, 5 + root), (0, 3 - root), None, (0, 1), (1, 3 + side), (1, 2 - side), None, (2, 4), (3, 4), None, None]
        for precision in PRECISIONS if IS_LONG or not HAS_DOUBLE else ["double"]:
            for ray, hit, right in zip(rays, self.hits("scene.yaml", rays, f"--precision {precision}"), expected):
                self.assertEqual(hit is None, right is None, f"{precision}: {ray}")
                if hit:
                    self.assertEqual(hit[0], right[0], f"{precision}: {ray}")
                    self.assertLess(abs(hit[1] - right[1]), 2e-6, f"{precision}: {ray}")

    def test_half_a_square(self):
        """The image of a square whose left half is cut out is that of half a square, even in a mirror and behind glass."""
        rest = (
            "camera: {position: [0.3, 0.4, -4], look_at: [0, 0, 0], fov: 50}\nlights: [{point: {position: [-2, 2, -3]}}]\n"
            "objects:\n  - plane: {point: [0, 0, 1.5], normal: [0, 0, -1], material: {reflection: 0.6}}\n"
            "  - sphere: {center: [0.2, 0.4, -1.5], radius: 0.5, material: {transmission: 0.8}}\n"
            f"  - {UNSEEN}\n"
        )
        half = QUAD.replace("v -1", "v 0").replace("vt 0", "vt 0.5")
        write("half.obj", half)
        images = []
        for name, cutout in ("quad", ", cutout: 0.5"), ("half", ", cutout: 0"):
            write(f"{name}.yaml", rest + f"  - mesh: {{file: {name}.obj, material: {{image: half.png{cutout}}}}}\n")
            warned = "the alpha of 'half.png' is ignored" in self.glint(f"render {name}.yaml -o {name}.npy --size 64x64").stderr
            self.assertEqual(warned, name == "half")
            images.append(npy_read(f"{name}.npy")[2])
        unequal = [i for i, (a, b) in enumerate(zip(*images)) if max(abs(p - q) for p, q in zip(a, b)) > 1e-5]
        self.assertLess(len(unequal), 64)  # pixels whose ray, or mirrored ray, is at the edge
        self.assertGreater(len([i for i, (a, b) in enumerate(zip(*images)) if a == b]), 3800)

    def test_formats(self):
        """The same holes by YAML, MTL and glTF, of which a factor multiplies the alpha."""
        # with a light, a mirror and glass behind the eye, so that the kernel of the test above serves these scenes
        head = ("camera: {position: [0, 0, 5], look_at: [0, 0, 0], fov: 30}\nlights: [{point: {position: [0, 0, 9]}}]\n"
                "objects: [{plane: {point: [0, 0, 900], normal: [0, 0, 1], material: {reflection: 0.6}}},\n"
                "  {sphere: {center: [0, 0, 800], radius: 1, material: {transmission: 0.8}}}, {mesh: {file: ")
        hole_png("gray.png", 0)
        write("named.obj", "mtllib a.mtl\nusemtl m\n" + QUAD)
        blends = "the alpha of '{}' does not blend; the surface is cut out where it is below 0.5"

        def objects(mesh, *warnings, material=""):
            write("scene.yaml", f"{head}{mesh}{material}}}}}, {{{UNSEEN}}}]\n")
            stderr = self.glint("render scene.yaml -o a.npy --size 40x40 --aov object").stderr
            self.assertEqual(stderr.count("warning"), len(warnings), stderr)
            for warning in warnings:
                self.assertIn(warning, stderr)
            return [value != 0xFFFFFFFF for value in npy_read("a.object.npy")[2]]

        expected = objects("quad.obj", material=", material: {image: hole.png, cutout: 0.5}")
        share = sum(expected) / len(expected)
        square = (2 / (2 * 5 * math.tan(math.radians(15)))) ** 2
        self.assertLess(abs(share / (square * (1 - math.pi * HOLE**2 / 4)) - 1), 0.05)
        for lines, warnings in [
            ("map_d hole.png\n", [blends.format("hole.png")]),
            ("map_d gray.png\n", [blends.format("gray.png")]),
            ("map_Kd half.png\nmap_d gray.png\n", [blends.format("gray.png"), "the alpha of 'half.png' is ignored"]),
            ("map_Kd hole.png\nmap_d hole.png\n", [blends.format("hole.png")]),
        ]:
            write("a.mtl", "newmtl m\n" + lines)
            self.assertEqual(objects("named.obj", *warnings), expected, lines)
        write("a.mtl", "newmtl m\nmap_Kd half.png\nmap_d missing.png\n")
        missing = "cannot read 'missing.png': No such file or directory; nothing is cut out"
        self.assertGreater(sum(objects("named.obj", missing, "the alpha of 'half.png' is ignored")), sum(expected))
        for options, warnings in [
            ({"alphaMode": "MASK"}, []),
            ({"alphaMode": "MASK", "alphaCutoff": 0.25, "factor": 0.5}, []),
            ({"alphaMode": "BLEND"}, [blends.format("hole.png")]),
        ]:
            self.assertEqual(objects(self.gltf(**options), *warnings), expected, options)
        for options, count in [({}, square), ({"alphaMode": "MASK", "alphaCutoff": 0}, square), ({"alphaMode": "MASK", "alphaCutoff": 0.75, "factor": 0.5}, square)]:
            self.assertLess(abs(sum(objects(self.gltf(**options))) / 1600 / count - 1), 0.05, options)

    def test_each_use_decides_about_alpha(self):
        """A material shows an image's alpha, another ignores it, whatever the rest of the scene does with the same image."""
        head = "camera: {position: [0, 0, 5], look_at: [0, 0, 0]}\nlights: [{point: {position: [0, 2, 5]}}]\nobjects:\n"
        opaque = "  - mesh: {file: %s}\n" % self.gltf()
        plain = "  - mesh: {file: quad.obj, material: {image: hole.png}}\n"
        for objects, count in (opaque, 0), (opaque + plain, 1), (plain + opaque, 1):
            stderr = self.glint(f"check {write('scene.yaml', head + objects)}").stderr
            self.assertEqual(stderr.count("the alpha of 'hole.png' is ignored, so its transparent parts are opaque"), count, stderr)
            self.assertEqual(stderr.count("alpha"), count, stderr)
        cut = "  - mesh: {file: quad.obj, material: {image: hole.png, cutout: 0.5}}\n"
        self.assertNotIn("alpha", self.glint(f"check {write('scene.yaml', head + cut + opaque)}").stderr)
        blended = "  - mesh: {file: %s}\n" % self.gltf(alphaMode="BLEND")
        self.assertIn("the alpha of 'hole.png' does not blend", self.glint(f"check {write('scene.yaml', head + blended + cut)}").stderr)

    def gltf(self, factor=1, **material):
        pbr = {"baseColorTexture": {"index": 0}, "baseColorFactor": [1, 1, 1, factor]}
        gltf = Gltf(images=[{"uri": "hole.png"}], textures=[{"source": 0}], materials=[material | {"pbrMetallicRoughness": pbr}])
        corners = gltf.accessor([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
        gltf.square(WHOLE, attributes={"POSITION": corners}, material=0)
        return gltf.write("a.gltf")

    def test_refused(self):
        """Certified and certify refuse cutouts and normal maps. An opaque image is named."""
        png("opaque.png", [[1, 1]])
        scene = "camera: {position: [0, 0, -5], look_at: [0, 0, 0]}\nlights: [{point: {position: [1, 2, -5]}}]\nobjects: [{sphere: {center: [0, 0, 0], radius: 1, material: {image: %s.png, cutout: 0.5}}}]\n"
        write("half.yaml", scene % "half")
        write("opaque.yaml", scene % "opaque")
        self.glint("check half.yaml")
        self.assertIn("the alpha of 'opaque.png' is 1 everywhere, so nothing is cut out", self.glint("check opaque.yaml").stderr)
        self.refuses("render half.yaml -o a.npy --precision certified", r"certified has no error bounds for 'cutout' \(sphere on line 3\)")
        self.glint("render opaque.yaml -o a.npy --precision certified --size 4x4")
        self.glint("certify opaque.yaml --size 4x4" + (" --precision single" if not IS_LONG else ""))
        self.refuses("certify half.yaml", "the reference in quadruple precision does not support cutouts, so this scene cannot be certified")
        write("bumps.yaml", scene.replace("image: %s.png, cutout: 0.5", "normal_map: half.png"))
        self.glint("check bumps.yaml")
        self.refuses("render bumps.yaml -o a.npy --precision certified", r"certified has no error bounds for normal maps \(sphere on line 3\)")
        self.refuses("certify bumps.yaml", "the reference in quadruple precision does not support normal maps, so this scene cannot be certified")


def write_bytes(path, data):
    with open(path, "wb") as file:
        file.write(data)


if __name__ == "__main__":
    main()
