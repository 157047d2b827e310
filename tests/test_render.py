#!/usr/bin/env -S python3 -B
"""Tests what glint render writes: images in each format, their notes and layers, and how options change them."""
import json
import math
import os
import re
import resource
import struct
import unittest
from pathlib import Path

from glint import IS_LONG, IS_SANITIZED, ROOT, SPHERE, TestCase, main, need_device, npy_read, png_read, read, write

SMALL = "--size 8x6 --quiet"
SCENES = ROOT / "tests/scenes"


class Images(TestCase):
    files = {"sphere.yaml": SPHERE, "rays": "0 0 -4  0 0 1\n"}

    def test_a_scene_alone_is_rendered(self):
        camera, lights, objects = ('{"position": [0, 0, -4], "look_at": [0, 0, 0]}',
                                   '[{"point": {"position": [3, 4, -5]}}]',
                                   '[{"sphere": {"center": [0, 0, 0], "radius": 1, "material": {"reflection": 0.1}}}]')
        write("s.json", f'{{"camera": {camera}, "lights": {lights},\n\t"objects": {objects}}}')
        write("s.yaml", f"camera: {camera}\nlights: {lights}\nobjects: {objects}\n")
        self.glint(f"render s.yaml {SMALL} -o command.ppm")
        for scene in "s.yaml", "s.json", "./s.yaml":
            self.glint(f"{scene} {SMALL} -o alone.ppm")
            self.assertEqual(Path("alone.ppm").read_bytes(), Path("command.ppm").read_bytes(), scene)

    def test_values_are_set(self):
        """The image equals that of a scene with these values, and its notes list them."""
        write("small.yaml", SPHERE.replace("fov: 60", "fov: 40").replace("radius: 1", "radius: 0.5").replace("{reflection", "{color: [1, 0, 0], reflection"))
        self.glint(f"render small.yaml {SMALL} -o small.png")
        values = "camera.fov=40", "objects[0].sphere.radius=0.5", "objects[0].sphere.material={color: red, reflection: 0.1}"
        options = " ".join(f"--set '{value}'" for value in values)
        self.glint(f"render sphere.yaml {SMALL} {options} -o set.png")
        _, rows, texts, _ = png_read("set.png")
        self.assertEqual(rows, png_read("small.png")[1])
        self.assertEqual(texts["Set"], "\n".join(values))
        trace = "trace {} --rays rays"
        self.assertEqual(self.glint(f"{trace.format('sphere.yaml')} {options}").stdout, self.glint(trace.format("small.yaml")).stdout)
        bounds = "bounds +-0.5 -0.5 -0.5"
        self.assertRegex(self.glint(f"check sphere.yaml {options}").stdout, bounds)

    def test_camera_of_another_scene(self):
        """The camera's keys are used, but not its file's objects or their warnings. The scene needs no camera, and --set changes it."""
        camera, *others = SPHERE.splitlines(keepends=True)
        moved = camera.replace("fov: 60", "fov: {keys: {0: 60, 2: 20}}")
        self.assertNotEqual(moved, camera)
        write("objects.yaml", "".join(others))
        write("shot.yaml", moved)
        write("whole.yaml", moved + "".join(others).replace("radius: 1", "radius: 0.5"))
        process = self.glint(f"render objects.yaml --camera shot.yaml --set objects[0].sphere.radius=0.5 --frames 1 {SMALL} -o a%d.ppm")
        self.assertNotIn("warning", process.stderr)
        self.glint(f"render whole.yaml --frames 1 {SMALL} -o b%d.ppm")
        self.assertSameBytes("a1.ppm", "b1.ppm")
        write("bad.yaml", camera.replace("fov", "fow"))
        self.refuses("render objects.yaml --camera bad.yaml", "^bad.yaml:1:[0-9]+: error: unknown camera key 'fow'")
        self.refuses("render whole.yaml --camera shot.yaml --set camera.fov=9", "--set camera.fov=9 cannot change the camera, which is that of 'shot.yaml'")
        self.refuses("render objects.yaml --camera -", "--camera: expected the name of a file")
        write("far.yaml", "camera: {position: [0, 0, 5], look_at: [0, 0, 0], height: 1e30, shift: [1e30, 0]}\n")
        self.refuses("render objects.yaml --camera far.yaml", "does not fit precision single")
        self.refuses("render objects.yaml", "^objects.yaml:1:1: error: the scene lacks 'camera'")
        write("shot.ppm", "begin_scene\nresolution 80 60\ncamera zoom 1 aspectratio 1 antialiasing 0 raydepth 8\n"
              "center 1 2 3 viewdir -1 -2 -3 updir 0 1 0\nend_camera\nend_scene\n")
        self.glint(f"render sphere.yaml --camera shot.ppm {SMALL} -o c.ppm")
        write("same.yaml", "camera: {position: [1, 2, -3], look_at: [0, 0, 0], focal_length: 1, frame: [1.3333333333333333, 1]}\n" + "".join(others))
        self.glint(f"render same.yaml {SMALL} -o d.ppm")
        self.assertSameBytes("c.ppm", "d.ppm")
        self.refuses(f"render sphere.yaml --camera shot.ppm {SMALL} -o shot.ppm", "would overwrite 'shot.ppm'")

    def test_display(self):
        """The PNG has the curve's values of the linear image, and its notes name the options. A region has the same pattern."""
        options = "--size 20x12 --quiet --samples 2"
        self.glint(f"render sphere.yaml {options} -o linear.npy")
        linear = [value * 2**1.5 for pixel in npy_read("linear.npy")[-1] for value in pixel]
        self.glint(f"render sphere.yaml {options} --exposure 1.5 --tone filmic --transfer none --bits 16 -o a.ppm")
        shown = struct.unpack(">720H", Path("a.ppm").read_bytes()[len("P6\n20 12\n65535\n"):])
        for x, value in zip(linear, shown):
            self.assertAlmostEqual(value, 65535 * min(1, x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)), delta=0.51)
        self.assertGreater(len(set(shown)), 30)
        self.glint(f"render sphere.yaml {options} --exposure 1.5 --tone filmic -o a.png")
        texts = png_read("a.png")[2]
        self.assertEqual((texts["Exposure"], texts["Tone"]), ("1.5", "filmic"))
        self.assertNotIn("Dither", texts)
        self.glint(f"render sphere.yaml {options} --dither --tone none --exposure 0 -o b.ppm")
        self.glint(f"render sphere.yaml {options} -o c.ppm")
        self.glint(f"render sphere.yaml {options} --dither --region 3,5,7,6 -o d.ppm")
        dithered, plain, part = (Path(name).read_bytes() for name in ("b.ppm", "c.ppm", "d.ppm"))
        self.assertNotEqual(dithered, plain)
        self.assertTrue(all(abs(a - b) <= 1 for a, b in zip(dithered[13:], plain[13:])))
        whole = dithered[len("P6\n20 12\n255\n"):]
        for y in range(6):
            start = 3 * (20 * (5 + y) + 3)
            self.assertEqual(part[len("P6\n7 6\n255\n"):][21 * y : 21 * y + 21], whole[start : start + 21])

    def test_several_scenes(self):
        self.glint(f"render sphere.yaml {SMALL} -o one.png")
        write("other.yaml", SPHERE)
        write("bad.yaml", "camera: 5\n")
        os.mkdir("frames")
        self.refuses(f"render sphere.yaml bad.yaml other.yaml missing.nff {SMALL} -o frames", "(?s)bad.yaml:1.*missing.nff")
        self.assertEqual(sorted(os.listdir("frames")), ["other.png", "sphere.png"])
        self.assertEqual(png_read("frames/sphere.png")[:2], png_read("one.png")[:2])
        self.assertEqual(png_read("frames/other.png")[2]["Scene"], "other.yaml")
        os.remove("frames/other.png")
        os.remove("frames/sphere.png")
        os.mkdir("frames/sphere.png")
        self.refuses(f"render sphere.yaml other.yaml {SMALL} -o frames", "frames/sphere.png")
        self.assertTrue(os.path.isfile("frames/other.png"))

    def test_png(self):
        self.glint(f"render sphere.yaml {SMALL}")
        head, rows, texts, chunks = png_read("sphere.png")
        self.assertEqual((head, len(rows)), ((8, 6, 8, 2), 6 * 25))
        self.assertIn("sRGB", chunks)
        expected = {"Scene": "sphere.yaml", "Precision": "single", "Size": "8x6"}
        self.assertEqual(texts | expected, texts)
        for key in "Software Device Driver Lanes Samples Bounces Region Transfer Kernel".split():
            self.assertTrue(texts[key], key)

    def test_notes_of_options(self):
        """An option that changes the image is in its notes, and only then."""
        notes = {"--perturb 3:2": ("Perturb", "3:2"), "--camera other.yaml": ("Camera", "other.yaml"),
                 "--build-options=-DUNUSED": ("BuildOptions", "-DUNUSED"), "--lenient": ("Lenient", "yes")}
        write("other.yaml", SPHERE)
        self.glint(f"render sphere.yaml {SMALL}")
        usual = png_read("sphere.png")[2]
        for option, (key, value) in notes.items():
            self.assertNotIn(key, usual)
            self.glint(f"render sphere.yaml {SMALL} {option}")
            self.assertEqual(png_read("sphere.png")[2].get(key), value)

    def test_png_of_16_bits(self):
        self.glint(f"render sphere.yaml {SMALL} --bits 16 --transfer none --samples 3 --region 2,1,4,3 -o deep.png")
        head, _, texts, chunks = png_read("deep.png")
        self.assertEqual(head, (4, 3, 16, 2))
        self.assertNotIn("sRGB", chunks)
        self.assertEqual(texts | {"Samples": "3", "Region": "2,1,4,3", "Transfer": "none"}, texts)

    def test_ppm_and_exr(self):
        for arguments, head, size in (
            ("-o a.ppm", b"P6\n8 6\n255\n", 11 + 8 * 6 * 3),
            ("-o a16.ppm --bits 16", b"P6\n8 6\n65535\n", 13 + 8 * 6 * 6),
            ("-o a.EXR", b"\x76\x2f\x31\x01", None),
        ):
            self.glint(f"render sphere.yaml {SMALL} {arguments}")
            data = Path(arguments.split()[1]).read_bytes()
            self.assertEqual((data[: len(head)], len(data)), (head, size or len(data)))

    def test_exr_of_a_region_with_aovs(self):
        """One file has the values of the NPY files as layers, and its windows place the region in the image."""
        whole = "render sphere.yaml --size 40x30 --alpha --aov t,object,normal,shadow -o"
        region = whole.replace("-o", "--region 8,4,24,16 -o")
        self.assertRegex(self.glint(f"{region} a.exr").stderr, r"glint: wrote a\.exr\n$")
        self.assertEqual([path.name for path in Path().glob("a.*")], ["a.exr"])
        data = Path("a.exr").read_bytes()
        windows = [struct.unpack("<4i", data.split(name + b"\0box2i\0\x10\0\0\0")[1][:16]) for name in (b"dataWindow", b"displayWindow")]
        self.assertEqual(windows, [(8, 4, 31, 19), (0, 0, 39, 29)])
        self.assertIn(b"glint.Transfer\0string\0\4\0\0\0none", data)
        channels = data.split(b"channels\0chlist\0")[1][4:]
        names = [name.decode() for name in re.findall(rb"([\w.]+)\0[\0\2]\0\0\0.{12}", channels[:500], re.DOTALL)]
        self.assertEqual(names[:10], ["A", "B", "G", "R", "depth.Z", "normal.X", "normal.Y", "normal.Z", "object.id", "shadow.0"])
        self.glint(f"{whole} b.exr")
        self.assertRegex(self.glint(f"{whole.replace('--alpha ', '')} b.npy").stderr, r"glint: wrote b\.npy, b\.t\.npy, b\.normal\.npy, b\.object\.npy, b\.shadow\.npy\n$")
        for name, layer in ("t", "depth"), ("object", "object"):
            self.assertIn("equal, bit for bit", self.glint(f"diff b.{name}.npy b.exr --layer {layer}").stdout)
        self.assertEqual(self.json("diff b.exr a.exr --json", status=3)["size"], [40, 30])
        self.refuses("diff b.exr a.exr --layer position", "no layer 'position'; its channels are A, B, G, R, depth.Z")

    @unittest.skipIf(IS_SANITIZED and not IS_LONG, "these values are the kernels', and a sanitized build of one takes twice as long")
    def test_precisions_and_lanes(self):
        images = {}
        for precision in "single", "strict", "double":
            for lanes in ("", *(f"--lanes {lanes}" for lanes in (1, 4, 8, 16) if precision == "single" and IS_LONG)):
                self.glint(f"render sphere.yaml {SMALL} --precision {precision} {lanes} -o {precision}.npy")
            shape, kind, images[precision] = npy_read(f"{precision}.npy")
            self.assertEqual((shape, kind), ((6, 8, 3), "<f8" if precision == "double" else "<f4"))
        self.assertAlmostEqual(images["single"][0][0], 0.1, delta=1e-7)
        self.assertGreater(max(map(max, images["single"])), 0.9)
        self.assertLess(max(map(math.dist, images["single"], images["double"])), 1e-5)
        self.glint(f"render sphere.yaml {SMALL} --no-cache --device 0 -o uncached.npy")
        self.assertSameBytes("uncached.npy", "single.npy")

    def test_rt_and_cfg(self):
        """Colors of these formats are display values, so the PNG states no sRGB curve."""
        for name in "complete.rt", "complete.cfg":
            self.glint(f"render {SCENES}/{name} {SMALL} -o other.png")
            self.assertNotIn("sRGB", png_read("other.png")[3])
        write("a.rt", read(SCENES / "complete.rt") + "bogus 1 2 3\n")
        self.refuses("check a.rt", "bogus")
        self.assertRegex(self.glint(f"render a.rt --lenient {SMALL}").stderr, "warning.*bogus")

    @unittest.skipIf(IS_SANITIZED and not IS_LONG, "the bits are the kernels'")
    def test_smaller_work_groups_give_the_same_bits(self):
        """A device may accept fewer work-items in a group than glint prefers. PoCL has a variable for it."""
        options = "--precision strict --lanes 1"  # the kernels of test_device_limits.py
        for limit in None, 32, 16, 1:
            env = {"POCL_MAX_WORK_GROUP_SIZE": str(limit)} if limit else {}
            self.glint(f"render sphere.yaml --size 33x21 --quiet {options} --aov object,path -o {limit}.npy", env=env)
            self.glint(f"trace sphere.yaml --rays rays {options} -o {limit}.csv", env=env)
            for ending in ".npy", ".object.npy", ".path.npy", ".csv":
                self.assertSameBytes(f"{limit}{ending}", f"None{ending}")


class Aovs(TestCase):
    files = Images.files

    def test_capture(self):
        """Each launch has a file, and names the files of its kernel's text and of its buffers by hashes of their contents."""
        self.glint(f"render sphere.yaml {SMALL} --capture launches --aov t -o image.npy")
        files = {path.name: path.read_bytes() for path in Path("launches").iterdir()}
        launches = {launch["kernel"]: launch for launch in map(json.loads, (files[name] for name in files if name.endswith(".json")))}
        self.assertEqual(sorted(launches), ["aov", "render"])
        used = set()
        for kernel, launch in launches.items():
            self.assertEqual([argument["index"] for argument in launch["arguments"]], list(range({"aov": 9, "render": 14}[kernel])))
            self.assertIn(f"kernel void {kernel}(".encode(), files[launch["text"]])
            self.assertIn("-cl-std=CL1.2", launch["options"])
            used |= {launch["text"], *(argument["buffer"] for argument in launch["arguments"] if argument.get("buffer"))}
        self.assertEqual(used, {name for name in files if not name.endswith(".json")})
        for name in sorted(files, key=lambda name: len(files[name]))[:5]:
            hashed = 0xCBF29CE484222325
            for byte in files[name]:
                hashed = (hashed ^ byte) * 0x100000001B3 % 2**64
            self.assertEqual(name.partition(".")[0], f"{hashed:016x}")
        self.refuses("render sphere.yaml --capture none/launches", "--capture: cannot create the folder 'none/launches'")
        # a folder is made only once the whole command line was accepted
        for mistake in "--lanes 3", "--alpha -o image.npy", "--skip-existing --timing=json":
            self.refuses(f"render sphere.yaml --capture unmade {mistake}", "glint( render)?: ")
            self.assertFalse(Path("unmade").exists())
        # locate would repeat what is left of other renders
        self.refuses("render sphere.yaml --capture launches", "--capture: the folder 'launches' is not empty")
        limit = (4096, resource.RLIM_INFINITY)  # below the size of a kernel's text
        self.refuses(f"render sphere.yaml {SMALL} --capture full -o none.npy", "capture on .*: cannot write 'full/.*': File too large", 2,
                     preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit))
        self.assertFalse(Path("none.npy").exists())

    def test_aovs(self):
        layouts = {"t": ((6, 8), "<f4"), "normal": ((6, 8, 3), "<f4"), "position": ((6, 8, 3), "<f8"),
                   "object": ((6, 8), "<u4"), "shadow": ((6, 8, 2), "<u4"), "ray": ((6, 8, 3), "<f4"),
                   "path": ((6, 8), "<u4"), "color": ((6, 8, 3), "<f4"), "flag": ((6, 8), "<u4")}
        self.glint(f"render sphere.yaml {SMALL} --bounces 0 --aov {','.join(layouts)} -o v.png")
        self.glint(f"render sphere.yaml {SMALL} --bounces 0 -o v.npy")
        self.assertSameBytes("v.color.npy", "v.npy")
        pixels = {}
        for name, layout in layouts.items():
            *found, pixels[name] = npy_read(f"v.{name}.npy")
            self.assertEqual(tuple(found), layout, name)
        self.assertEqual(set(pixels["object"]), {0, 2**32 - 1})
        self.assertEqual(set(pixels["flag"]), {0})
        names = "object", "t", "path", "normal", "position", "ray", "shadow"
        for identity, t, path, normal, position, ray, shadow in zip(*(pixels[name] for name in names)):
            # FNV-1a of the word 8 (0 + 1) for the one object, of 0 for none
            self.assertEqual(path, (0x811C9DC5 ^ (8 if identity == 0 else 0)) * 0x01000193 % 2**32)
            self.assertAlmostEqual(math.hypot(*ray), 1, delta=1e-4)
            if identity != 0:
                self.assertEqual((t, normal, shadow), (math.inf, (0, 0, 0), (0, 0)))
                continue
            from_eye = [a - b for a, b in zip(position, (0, 0, -4))]
            self.assertAlmostEqual(math.hypot(*from_eye), t, delta=1e-4)
            self.assertLess(math.dist([t * a for a in ray], from_eye), 1e-4)
            self.assertLess(math.dist(normal, position), 1e-4)
            self.assertLess(normal[2], 0)
            cosine = sum(n * (light - p) for n, light, p in zip(normal, (3, 4, -5), position))
            self.assertTrue(abs(cosine) < 1e-3 or shadow[0] == (cosine < 0), cosine)

    @unittest.skipIf(IS_SANITIZED and not IS_LONG, "the values are the kernels'")
    def test_alpha(self):
        """Alpha is what objects cover, and colors lack the background. They are divided by alpha in PNG, not in EXR."""
        width, height = 40, 30
        write("disc.yaml", "camera: {position: [0, 0, 5], look_at: [0, 0, 0], fov: 40}\n"
              "background: {horizon: [0.5, 0.25, 1], zenith: [0.1, 0.9, 0]}\n"
              "objects: [{sphere: {center: [0, 0, 0], radius: 1, material: {color: 0, emission: [0.2, 0.6, 0.9]}}}]\n")
        for precision in ("strict", "certified") if IS_LONG else ("strict",):
            render = f"render disc.yaml --size {width}x{height} --samples 16 --lanes 1 --quiet --precision {precision}"
            self.glint(f"{render} --aov coverage,backdrop -o plain.npy")
            colors, backdrops, parts = (npy_read(f"plain{name}.npy")[2] for name in ("", ".backdrop", ".coverage"))
            # the sphere's circle and the image at the distance 1
            disc, image = math.pi / (5**2 - 1), (2 * math.tan(math.radians(20))) ** 2 * width / height
            self.assertAlmostEqual(sum(parts) / len(parts), disc / image, delta=1e-3)
            self.assertTrue({0, 1} < set(parts) and all(16 * part == int(16 * part) for part in parts))
            self.glint(f"{render} --alpha --bits 16 --transfer none -o alpha.png")
            os.makedirs("folder", exist_ok=True)  # whose images are PNG
            write("other.yaml", read("disc.yaml"))
            self.glint(f"{render.replace('disc.yaml', 'disc.yaml other.yaml')} --alpha -o folder")
            self.assertEqual(png_read("folder/disc.png")[0][3], 6)
            (*size, bits, kind), rows, *_ = png_read("alpha.png")
            self.assertEqual((size, bits, kind), ([width, height], 16, 6))
            row_size = 1 + 8 * width
            for row in range(height):
                data = bytearray(rows[row * row_size : (row + 1) * row_size])
                self.assertEqual(data.pop(0), 1)  # each byte is the difference to that of the pixel before
                for i in range(8, len(data)):
                    data[i] = (data[i] + data[i - 8]) % 256
                for column, pixel in enumerate(struct.iter_unpack(">4H", data)):
                    i = row * width + column
                    self.assertEqual(pixel[3], round(65535 * parts[i]))
                    for channel, emission in enumerate((0.2, 0.6, 0.9)):
                        self.assertAlmostEqual(colors[i][channel] - backdrops[i][channel], parts[i] * emission, delta=1e-6)
                        self.assertAlmostEqual(pixel[channel] / 65535, emission if parts[i] > 0 else 0, delta=2e-5)
            for options in "-o black.npy", "--alpha -o black.exr":
                self.glint(f"{render} --set background='{{horizon: 0, zenith: 0}}' --aov coverage {options}")
            self.assertIn("equal, bit for bit", self.glint("diff black.npy black.exr").stdout)
            self.assertIn("equal, bit for bit", self.glint("diff black.coverage.npy black.exr --layer coverage").stdout)
        for name in "a.ppm", "a.npy":
            self.refuses(f"render disc.yaml --alpha -o {name}", "--alpha is for PNG and EXR")

    def test_interpolated_normal_is_turned_with_its_triangle(self):
        """Near silhouettes the normal may point away from the eye, whichever way the file turns it."""
        corners = (-0.05, -1, -1), (0.05, -1, 1), (0, 1, 0)
        for x, z in (1, 0.3), (-1, -0.3), (1, -0.3):
            lines = [f"v {' '.join(map(str, corner))}" for corner in corners]
            write("mesh.obj", "\n".join([*lines, f"vn {x} 0 {z}", "f 1//1 2//1 3//1\n"]))
            write("mesh.yaml", "camera: {position: [0.4, -0.5, -40], look_at: [0, -0.5, 0], fov: 0.05}\n"
                               "lights: [{point: {position: [0, 0, -50]}}]\nobjects: [{mesh: {file: mesh.obj}}]\n")
            self.glint("render mesh.yaml --size 1x1 --aov normal,ray -o mesh.png")
            (*_, (normal,)), (*_, (ray,)) = npy_read("mesh.normal.npy"), npy_read("mesh.ray.npy")
            sign = 1 if x > 0 else -1
            expected = [sign * value / math.hypot(x, z) for value in (x, 0, z)]
            self.assertLess(math.dist(normal, expected), 1e-6)
            self.assertEqual(sum(n * r for n, r in zip(normal, ray)) > 0, sign * z > 0)

    def test_no_shadows_without_lights(self):
        write("unlit.yaml", re.sub("lights:.*(?=objects)", "ambient: [1, 1, 1]\n", SPHERE, flags=re.DOTALL))
        self.assertRegex(self.glint(f"render unlit.yaml {SMALL} --aov shadow -o u.png").stderr, "shadow.*no lights")
        self.nothing_left("u.shadow.npy")


if __name__ == "__main__":
    need_device()
    main()
