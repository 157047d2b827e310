#!/usr/bin/env -S python3 -B
"""Compares soft shadows, the lens, parallel rays and the sky with geometry, and tests how the error falls with the samples."""
import itertools
import math
from pathlib import Path

import glint
from glint import IS_LONG, TestCase, main, npy_read, need_device, png_bytes, skip_all, write

DARK = "sphere: {center: [0, 1000, 0], radius: 1", "spot: {position: [0, 1000, 0], look_at: [0, 0, 0], angle: 20", "directional: {direction: [0, -1, 0]"
PRECISIONS = ("single", "strict", "double") if IS_LONG else ("strict",)


def png_write(name, width, height, color):
    """Writes an image of 8 bits, where `color` returns the three values of a column and a row."""
    Path(name).write_bytes(png_bytes([bytes(value for x in range(width) for value in color(x, y)) for y in range(height)]))


def cap(x):
    """Returns the part of a disc of radius 1 on the side of a chord at x that holds the center if x is above 0."""
    x = min(max(x, -1), 1)
    return 0.5 + (x * math.sqrt(1 - x * x) + math.asin(x)) / math.pi


class Soft(TestCase):
    def row(self, text, size, options="", **run):
        """Returns the red channel of the middle row."""
        write("soft.yaml", text)
        self.glint(f"render soft.yaml --quiet --lanes 1 --size {size[0]}x{size[1]} -o soft.npy {options}", **run)
        values = npy_read("soft.npy")[2]
        middle = size[1] // 2
        return [values[middle * size[0] + column][0] for column in range(size[0])]

    @staticmethod
    def lights(light):
        """Returns a scene's list of lights. Dark ones, unless tests are long, let the same kernel serve every type of light."""
        others = () if IS_LONG else (f"{dark}, intensity: 0}}" for dark in DARK)
        return "lights:\n" + "".join(f"  - {text}\n" for text in (light, *others))

    def penumbra(self, light, options):
        """Returns the part of the light that arrives at x from -0.2 to 0.2 on a floor behind the edge of a wall that ends at x = 0,
        a tenth of the way up to the light, which is far above."""
        camera = "camera: {position: [0, 50, 0], look_at: [0, 0, 0], up: [0, 0, 1], height: 0.025}\n"
        # seen from above, x grows to the left; the second wall casts no shadow there
        scene = f"{camera}{self.lights(light)}objects:\n  - plane: {{point: [0, 0, 0], normal: [0, 1, 0]}}\n"
        walls = (f"  - box: {{min: [{left - 1000}, 100, -1000], max: [{left}, 101, 1000]}}\n" for left in (0, -9000))
        return [self.row(scene + wall, (80, 5), options)[::-1] for wall in walls]

    def test_shadows(self):
        """The penumbra of each light follows the part of its area beyond the edge."""
        # at 1000 up an area of half-width 1.8 has a penumbra of half-width 0.2 behind an edge at 100
        lights = {
            "rectangle: {center: [0, 1000, 0], edges: [[3.6, 0, 0], [0, 0, 9]]}": lambda x: min(max(0.5 + x / 2, 0), 1),
            "disc: {center: [0, 1000, 0], normal: [0, 1, 0], radius: 1.8}": cap,
            # narrows to a point at x = 1.8
            "triangle: {vertices: [[1.8, 1000, 0], [-1.8, 1000, 3], [-1.8, 1000, -3]]}": lambda x: (1 + x) ** 2 / 4,
            "sphere: {center: [0, 1000, 0], radius: 1.8}": cap,
            "spot: {position: [0, 1000, 0], look_at: [0, 0, 0], angle: 20, radius: 1.8}": cap,
            # tan(angle / 2) = 0.2 / 100
            "directional: {direction: [0, -2, 0], angle: 0.229182812}": cap,
        }
        for light, expected in lights.items():
            for precision in PRECISIONS:
                with self.subTest(light, precision=precision):
                    dark, full = self.penumbra(light, f"--samples 1024 --precision {precision}")
                    for i, value in enumerate(dark):
                        x = (2 * i + 1 - len(dark)) / len(dark)
                        self.assertAlmostEqual(full[i], 1, delta=2e-3)
                        # a directional light's wall is 1 thick
                        self.assertAlmostEqual(value, expected(x), delta=0.02, msg=(i, x))

    def test_lamps(self):
        """Visible lights show their color and change no other pixel, since they cast no shadows."""
        camera = "camera: {position: [0, 2.5, 8], look_at: [0, 1.5, 0], fov: 45}\nlights:\n"
        lights = [("sphere: {{center: [-2.2, 2.5, 0], radius: 0.4, color: [1, 0.75, 0.5]{}}}", (1, 0.75, 0.5)),
                  ("rectangle: {{center: [2.5, 3.5, -1], edges: [[1.5, 0, 0], [0, 1, 0.3]], intensity: 0.5{}}}", (0.5, 0.5, 0.5)),
                  ("disc: {{center: [0, 4, 1], normal: [0, -1, 0.4], radius: 0.6, color: [4, 0, 1]{}}}", (4, 0, 1)),
                  ("triangle: {{vertices: [[-2, 4, 0], [-1, 4, 0], [-1, 5, 1]], color: [0, 2, 1]{}}}", (0, 2, 1))]
        # behind the eye, so that the same kernels serve both scenes
        objects = ("  - disc: {center: [0, 2, 99], normal: [0, 0, 1], radius: 1, intensity: 0.1, visible: true}\n"
                   "  - rectangle: {center: [0, 2, 99], edges: [[1, 0, 0], [0, 1, 0]], intensity: 0.1, visible: true}\n"
                   "objects:\n  - plane: {point: [0, 0, 0], normal: [0, 1, 0]}\n  - sphere: {center: [-2, 0.7, 1], radius: 0.7}\n"
                   "  - box: {min: [0, 0, 0], max: [1, 2, 1]}\n")
        for precision in PRECISIONS:
            with self.subTest(precision=precision):
                for name, key in ("hidden", ""), ("shown", ", visible: true"):
                    write(f"{name}.yaml", camera + "".join(f"  - {text.format(key)}\n" for text, _ in lights) + objects)
                    self.glint(f"render {name}.yaml --quiet --lanes 1 --size 96x64 --aov object --precision {precision} -o {name}.npy")
                hidden, shown, numbers = (npy_read(f"{name}.npy")[2] for name in ("hidden", "shown", "shown.object"))
                # the rectangle is two triangles
                lamps = {3: 0, 4: 1, 5: 1, 6: 2, 7: 3}
                self.assertEqual(set(numbers) & lamps.keys(), lamps.keys())
                for before, after, number in zip(hidden, shown, numbers):
                    self.assertEqual(after, lights[lamps[number]][1] if number in lamps else before)

    def test_no_shadow(self):
        """A material may cast no shadows, next to others that do."""
        text = ("camera: {{position: [0, 5, 9], look_at: [0, 0, 0]}}\nlights: [{{point: {{position: [0, 9, 0]}}}}]\nobjects:\n"
                "  - plane: {{point: [0, 0, 0], normal: [0, 1, 0]}}\n  - sphere: {{center: [-2, 2, 0], radius: 1}}\n"
                "  - sphere: {{center: [2, 2, 0], radius: 1, material: {{shadow: {}}}}}\n"
                # below the floor, so that the same kernels serve both scenes
                "  - sphere: {{center: [0, -9, 0], radius: 1, material: {{shadow: false}}}}\n")
        dark = {}
        for shadow in "true", "false":
            write("soft.yaml", text.format(shadow))
            self.glint("render soft.yaml --quiet --lanes 1 --size 64x48 --aov object,shadow -o soft.npy")
            floor = zip(npy_read("soft.object.npy")[2], npy_read("soft.shadow.npy")[2])
            flags = [number == 0 and light == 1 for number, light in floor]
            dark[shadow] = [sum(flags[i] for i in range(len(flags)) if (i % 64 < 32) == left) for left in (True, False)]
        self.assertEqual(dark["false"], [dark["true"][0], 0])
        self.assertGreater(dark["true"][1], 20)

    def test_error_falls(self):
        """The error falls as low-discrepancy points promise, faster than the root of the samples, by which that of random ones falls."""
        light = "rectangle: {center: [0, 1000, 0], edges: [[3.6, 0, 0], [0, 0, 9]]}"
        errors = []
        for samples in 16, 256:
            dark, _ = self.penumbra(light, f"--samples {samples} --precision strict")
            exact = [min(max(0.5 + (2 * i + 1 - len(dark)) / len(dark) / 2, 0), 1) for i in range(len(dark))]
            errors.append(math.sqrt(sum((a - b) ** 2 for a, b in zip(dark, exact)) / len(dark)))
        self.assertLess(errors[1], errors[0] / 5.5, errors)

    def test_focus(self):
        """An edge beyond the focal plane is blurred by the part of the lens that sees past it. One in the plane is sharp."""
        # the wall ends at x = 0, its distance is 10
        text = ("camera: {{position: [0, 0, 10], look_at: [0, 0, 0], fov: 2, aperture: 0.2, focus: {focus}}}\n"
                "ambient: 1\nbackground: 0\nobjects: [{{box: {{min: [0, -90, -1e-6], max: [90, 90, 0]}}}}]\n")
        size = 64, 64
        half = 10 * math.tan(math.radians(1))
        for focus, blur in ("5", 0.1), ("20", 0.05), ("[7, 8, 5]", 0.1), ("[0, 0, 0]", 0):
            with self.subTest(focus):
                row = self.row(text.format(focus=focus), size, "--samples 1024 --precision strict")
                for i, value in enumerate(row):
                    x = (2 * i + 1 - size[0]) / size[0] * half
                    exact = cap(x / blur) if blur else float(x > 0)
                    # a pixel is a fifth of the sharper blur wide
                    self.assertAlmostEqual(value, exact, delta=0.03, msg=(i, x))

    def test_no_lens(self):
        """Without an aperture `focus` changes nothing."""
        text = "camera: {{position: [1, 2, 6], look_at: [0, 0, 0]{}}}\nlights: [{{point: {{position: [3, 4, 5]}}}}]\n" + \
               "objects: [{{sphere: {{center: [0, 0, 0], radius: 1, material: {{reflection: 0.1}}}}}}]\n"
        plain = self.row(text.format(""), (32, 32))
        self.assertEqual(self.row(text.format(", focus: 3, aperture: 0"), (32, 32)), plain)

    def test_parallel_rays(self):
        """Pixels are evenly spaced on the scene at every distance. The window's height is that of the image."""
        # with the features of penumbra's scenes
        write("soft.yaml", "camera: {position: [1, 2, 6], look_at: [1, 2, 0], height: 3}\n" + self.lights(f"{DARK[0]}}}") +
              "objects:\n  - plane: {point: [0, 0, 1], normal: [0.3, 0.2, 1]}\n  - box: {min: [0, 0, 900], max: [1, 1, 901]}\n")
        for precision in PRECISIONS:
            with self.subTest(precision=precision):
                self.glint(f"render soft.yaml --quiet --lanes 1 --size 40x30 --aov position,ray --precision {precision} -o soft.npy")
                positions, rays = npy_read("soft.position.npy")[2], npy_read("soft.ray.npy")[2]
                for row in range(30):
                    for column in range(40):
                        x, y, _ = positions[40 * row + column]
                        self.assertEqual(tuple(rays[40 * row + column]), (0, 0, -1))
                        self.assertAlmostEqual(x, 1 + (2 * column - 39) / 60 * 3, delta=1e-5)
                        self.assertAlmostEqual(y, 2 - (2 * row - 29) / 60 * 3, delta=1e-5)

    def test_sky(self):
        """The sky has the colors of the poles, blended by the cosine. Its mean is the ambient light."""
        colors = {"horizon": (0.5, 0.25, 1), "zenith": (0, 0.5, 2), "nadir": (1, 0.75, 0)}
        given = ", ".join(f"{name}: {list(color)}" for name, color in colors.items())
        png_write("white.png", 1, 1, lambda column, row: (255, 255, 255))
        write("soft.yaml", "camera: {position: [0, 0, 5], look_at: [3, 2, 0], fov: 150}\n"
              f"background: {{{given}, up: [0, 0.6, 0.8]}}\n"
              "objects:\n  - sphere: {center: [0, 0, 0], radius: 1, material: {image: white.png}}\n"
              "  - box: {min: [0, 0, 900], max: [1, 1, 901]}\n")  # for the features of test_sky_image
        for precision in (*PRECISIONS, "certified"):
            with self.subTest(precision=precision):
                self.glint(f"render soft.yaml --quiet --lanes 1 --size 24x16 --aov ray,object --precision {precision} -o soft.npy")
                pixels, rays, objects = (npy_read(f"soft{name}.npy")[2] for name in ("", ".ray", ".object"))
                seen = {0.6 * ray[1] + 0.8 * ray[2] > 0 for ray in rays}
                self.assertIn(0, objects)
                for pixel, ray, number in zip(pixels, rays, objects):
                    height = 0.6 * ray[1] + 0.8 * ray[2]
                    pole = colors["zenith" if height > 0 else "nadir"]
                    for channel in range(3):
                        level = colors["horizon"][channel]
                        exact = level + abs(height) * (pole[channel] - level)
                        if number == 0:
                            exact = level / 2 + (colors["zenith"][channel] + colors["nadir"][channel]) / 4
                        self.assertAlmostEqual(pixel[channel], exact, delta=1e-6)
                self.assertEqual(seen, {True, False})

    def test_sky_image(self):
        """Directions have the texels of their longitude and latitude. The image's mean over all directions is the ambient light."""
        columns, rows = 64, 32
        # by column: around +z, -x, -z and +x, and by row: above 45 degrees, below -45 and in between
        sides = [(255, 255, 255), (0, 0, 255), (255, 0, 0), (0, 255, 0)]

        def texel(column, row):
            return (255, 255, 0) if row < 8 else (0, 0, 0) if row >= 24 else sides[(column + 8) // 16 % 4]

        png_write("sky.png", columns, rows, texel)
        scene = ("camera: {{position: [0, 0, 0], look_at: {}, up: [0.1, 0.9, 0.2], fov: 120}}\n"
                 "background: {{image: sky.png, intensity: 0.5{}}}\n"
                 # no ray hits the sphere
                 "objects: [{{box: {{min: [3, -1, -1], max: [4, 1, 1]}}}}, {{sphere: {{center: [0, 9, 0], radius: 1e-6}}}}]\n")
        # the ways to the image's middle, right quarter and top
        turns = {"": ((0, 0, -1), (1, 0, 0), (0, 1, 0)), ", turn: 90": ((-1, 0, 0), (0, 0, -1), (0, 1, 0)),
                 ", up: [0, 0, 1]": ((-1, 0, 0), (0, 1, 0), (0, 0, 1))}
        seen = set()
        for precision in (*PRECISIONS, "certified") if IS_LONG else PRECISIONS:
            for (turn, axes), look_at in itertools.product(turns.items(), ([1, 0.2, 0.3], [-1, 2, -0.5], [0.1, -1, 1])):
                write("soft.yaml", scene.format(look_at, turn))
                self.glint(f"render soft.yaml --quiet --lanes 1 --size 32x24 --aov ray,object --precision {precision} -o soft.npy")
                pixels, rays, objects = (npy_read(f"soft{name}.npy")[2] for name in ("", ".ray", ".object"))
                for pixel, ray, number in zip(pixels, rays, objects):
                    ahead, right, up = (sum(a * b for a, b in zip(ray, axis)) for axis in axes)
                    u = 0.5 + math.atan2(right, ahead) / (2 * math.pi)
                    v = 0.5 - math.asin(max(-1, min(up, 1))) / math.pi
                    column, row = u * columns, v * rows
                    if number == 0:
                        sine = math.sin(math.pi / 4)
                        exact = [0.5 * (sine * sum(side[c] for side in sides) / 4 + (1 - sine) / 2 * (255, 255, 0)[c]) for c in range(3)]
                    else:
                        exact = [0.5 * value for value in texel(int(column) % columns, int(row))]
                        # between the texels' centers colors blend
                        near = {texel(int(column + x) % columns, min(max(int(row + y), 0), rows - 1)) for x in (-1, 1) for y in (-1, 1)}
                        if len(near) > 1:
                            continue
                        seen |= near
                    for channel in range(3):
                        self.assertAlmostEqual(pixel[channel], exact[channel] / 255, delta=2e-6, msg=(turn, ray))
        self.assertEqual(len(seen), 6)

    def test_panorama_of_sky(self):
        """An equirectangular camera that looks at the middle of a sky's image reproduces it."""
        columns, rows = 48, 24

        def texel(column, row):
            return column * 5, row * 10, (column * 7 + row * 13) % 256

        def linear(value):
            return value / 255 / 12.92 if value <= 10 else ((value / 255 + 0.055) / 1.055) ** 2.4

        png_write("sky.png", columns, rows, texel)
        for up, look_at in (([0, 1, 0], [0, 0, -3]), ([0, 0, 2], [-1, 0, 0])):
            write("soft.yaml", f"camera: {{position: [0, 0, 0], look_at: {look_at}, up: {up}, projection: equirectangular}}\n"
                  f"background: {{image: sky.png, up: {up}}}\nobjects: []\n")
            for precision in PRECISIONS:
                self.glint(f"render soft.yaml --quiet --size {columns}x{rows} --precision {precision} -o soft.npy")
                for i, pixel in enumerate(npy_read("soft.npy")[2]):
                    for value, exact in zip(pixel, texel(i % columns, i // columns)):
                        self.assertAlmostEqual(value, linear(exact), delta=1e-5, msg=(up, precision, i))

    def test_certified_refuses(self):
        """Certified refuses an area, a lens, a panorama and parallel rays, whose errors have no bound."""
        camera = "camera: {{position: [0, 0, 5], look_at: [0, 0, 0]{}}}\nlights: [{}]\nobjects: []\n"
        point, command = "point: {position: [0, 5, 0]}", "render soft.yaml --size 8x8 --precision certified -o soft.npy"
        for key, light, message in (("", "{sphere: {center: [0, 5, 0], radius: 1}}", "lights with an area"),
                                    (", aperture: 1", f"{{{point}}}", "a camera with an 'aperture'"),
                                    (", height: 1", f"{{{point}}}", "a camera with parallel rays"),
                                    (", projection: equirectangular", f"{{{point}}}", "an equirectangular camera")):
            write("soft.yaml", camera.format(key, light))
            self.refuses(command, f"certified has no error bounds for {message}; use another precision")
            if "projection" not in key:
                self.refuses("certify soft.yaml --precision strict --size 8x8", "the reference in quadruple precision does not support .*, so this scene cannot be certified")
        write("soft.yaml", camera.format("", f"{{{point}}}") + "background: {horizon: 1, zenith: 1, light: true}\n")
        self.refuses(command, "certified has no error bounds for a sky that is a light")
        write("soft.yaml", camera.format(", shift: [0, 5]", f"{{{point}}}"))
        self.refuses(command, "'shift' moves the middle of the frame to [0-9.]+ focal lengths from the eye, where certified has error bounds up to 4.33")
        ghost = "materials: {{ghost: {{shadow: false}}}}\nobjects: [{{sphere: {{center: [0, 0, 0], radius: 1{}}}}}" + \
                ", {{sphere: {{center: [3, 0, 0], radius: 1, material: {{reflection: 0.1}}}}}}]\n"
        for material, refused in (", material: ghost", True), ("", False):
            write("soft.yaml", camera.replace("objects: []\n", "").format("", f"{{{point}}}") + ghost.format(material))
            self.refuses(command, "certified has no error bounds for 'shadow: false' \\(sphere on line 4\\); use another precision") if refused else self.glint(command)

    def test_far_focus(self):
        """A focal plane at infinity is that of the view's directions alone."""
        text = ("camera: {{position: [0, 0, 10], look_at: [0, 0, 0], fov: 2, aperture: 1e-6{}}}\n"
                "ambient: 1\nobjects: [{{box: {{min: [0, -90, -1e-6], max: [90, 90, 0]}}}}]\n")
        options = "--samples 4 --precision strict"  # whose kernel is that of test_focus
        near = self.row(text.format(""), (32, 8), options)
        self.assertEqual(self.row(text.format(", focus: 1e30"), (32, 8), options), near)
        self.assertEqual({0, 1}, set(near))

    def test_far_lights(self):
        """The squares of distances to the points of a light must be in range."""
        for light in "sphere: {center: [0, 5, 0], radius: 1e20}", "rectangle: {center: [0, 5, 0], edges: [[1e20, 0, 0], [0, 0, 1]]}":
            write("soft.yaml", f"camera: {{position: [0, 0, 5], look_at: [0, 0, 0]}}\nlights: [{{{light}}}]\nobjects: []\n")
            self.refuses("render soft.yaml --size 8x8 -o soft.npy", "a light is (1e.20|5e.19) from the eye, but at most")


if __name__ == "__main__":
    if glint.IS_SANITIZED:
        skip_all("sanitizers do not see kernels")
    need_device()
    main()
