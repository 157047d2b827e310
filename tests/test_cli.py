#!/usr/bin/env -S python3 -B
"""Tests the command line as a user sees it: every option, every message about a wrong one, the exit status, what is printed
where, and that a failure leaves an earlier image unchanged."""
import contextlib
import glob
import itertools
import json
import math
import os
import re
import resource
import signal
import struct
import subprocess
import time
import unittest
from pathlib import Path

from glint import (
    IS_LONG, IS_SANITIZED, PROGRAM, ROOT, SPHERE, TestCase, csv_rows, find_icd, main, need_device, npy_read, png_read, read, run, write,
)

SMALL = "--size 8x6 --quiet"
SCENES = ROOT / "tests/scenes"

# Key words of the message, and the command lines that get it: {A|B} stands for A and for B.
WRONG_COMMAND_LINES = [
    ("usage: glint COMMAND", ""),
    ('"rendr".*did you mean render', "rendr sphere.yaml"),
    ('unknown command "zzzzzz"$', "zzzzzz"),
    ("scene.*--help", "{render|trace|check}"),
    ("one scene", "{trace|check --json|check --object 0} sphere.yaml other.yaml"),
    ("would both be 'sphere.png'", "render sphere.yaml ./sphere.yaml"),
    ("--checkpoint takes one scene", "render sphere.yaml other.yaml --checkpoint saved"),
    ("--timing=trace takes one image", "render sphere.yaml other.yaml --timing=trace"),
    ("must be a folder", "render sphere.yaml other.yaml -o {nowhere|sphere.yaml|''}"),
    ("'--nonsense'", "{render sphere.yaml|trace sphere.yaml|check sphere.yaml|devices} --nonsense"),
    ("rays", "trace sphere.yaml"),
    ("requires an argument", "render sphere.yaml --size"),
    ("--size: expected", "render sphere.yaml --size {0x5|5x0|5|5x|5x5x5|-5x5|1048577x4|99999999999x4|wide}"),
    ("--samples: expected", "render sphere.yaml --samples {0|-1|1.5|many|1048577|99999999999999999999}"),
    ("--region: expected",
     "render sphere.yaml --region {1,2,3|1,2,3,4,5|1,2,0,4|1,2,3,0|-1,0,2,2|a,b,c,d|1,2,3,4x|9999999999,0,1,1}"),
    ("--region: .*8x6", "render sphere.yaml --size 8x6 --region {0,0,9,1|0,0,1,7|8,0,1,1|0,6,1,1|99999,0,1,1}"),
    ("^--set:1:12: error: 'fov' must be a number, not '6O'$",
     "{render|trace --rays rays|check|bench|accuracy|certify} sphere.yaml --set camera.fov=6O"),
    ("s.rt: only values of YAML scenes", "{render|check} s.rt --set camera.fov=60"),
    ("cannot read 'nowhere.yaml'", "{render|trace --rays rays|check|bench|accuracy|certify} sphere.yaml --camera nowhere.yaml"),
    ("--set: may be given at most 64 times", "check sphere.yaml" + 65 * " --set camera.fov=60"),
    ('--bits: .*"12"', "render sphere.yaml --bits 12"),
    ('--tone: .*"flimic".*did you mean filmic', "render sphere.yaml --tone flimic"),
    ("--exposure: expected", "render sphere.yaml --exposure {bright|1x|65|-65|nan|''}"),
    ("EXR and NPY hold linear", "render sphere.yaml -o a.{exr|npy} {--tone filmic|--exposure -1|--dither}"),
    ("--dither is for 8 bits", "render sphere.yaml --dither --bits 16"),
    ('--transfer: .*"srbg".*did you mean srgb', "render sphere.yaml --transfer srbg"),
    ('--timing: .*"jsn".*did you mean json', "render sphere.yaml --timing=jsn"),
    ('--aov: .*"nromal".*did you mean normal', "render sphere.yaml --aov t,nromal"),
    ("--aov: expected", "render sphere.yaml --aov {t,|''}"),
    ('--precision: .*"sinlge".*did you mean single', "{render|trace --rays rays} sphere.yaml --precision sinlge"),
    ('--lanes: expected 1, 4, 8 or 16, not "[30]"', "{render|trace --rays rays} sphere.yaml --lanes {3|0}"),
    (r'device.* "(toaster|99)".*: 0 \(', "{render|trace --rays rays} sphere.yaml --device {toaster|99}"),
    (r"missing\.yaml.*No such file", "{render|trace --rays rays|check|} missing.yaml"),
    (r"sphere\.txt", "{render|trace --rays rays|check} sphere.txt"),
    ("notes: a scene's name ends in", "{render|} notes"),
    ('unknown command "folder"', "folder"),
    (r"one scene, but 'b\.yaml' is a second", "trace --rays rays sphere.yaml b.yaml"),
    (r"writes CSV", "trace sphere.yaml --rays rays -o {hits.npy|hits.PNG}"),
    ("no-rays.*No such file", "trace sphere.yaml --rays no-rays"),
    (r"\.png, \.ppm, \.exr or \.npy", "render sphere.yaml -o image.{jpg|PNGX|}"),
    (r"nowhere/image\.png", f"render sphere.yaml {SMALL} -o nowhere/image.png"),
]

PRECISIONS = "single", "strict", "double", "certified"
# Arguments with which a command refuses its precision before anything else.
PRECISION_COMMANDS = {
    "render": "missing.yaml", "trace": "missing.yaml --rays rays", "bench": "missing.yaml", "accuracy": "missing.yaml",
    "certify": "missing.yaml", "verify": "no-such-case",
}

# Key words of the message, and the lines of rays that get it.
WRONG_RAYS = [
    ("^rays:2:10: error: expected", "0 0 -4 0 0 1\n0 0 -4 0 x 1"),
    ("^rays:1:1: error: expected .*7", "0 0 -4 0 0 1 0"),
    ("^rays:1:18: error: expected .*more", "0 0 -4 0 0 1 0 1 2"),
    ("precision", "0 0 -4 0 0 inf"),
    ("direction", "0 0 -4 0 -0 0"),
]


def alternatives(command):
    parts = re.split(r"\{(.*?)\}", command)
    choices = [part.split("|") if index % 2 else [part] for index, part in enumerate(parts)]
    return ["".join(words) for words in itertools.product(*choices)]


class CliTestCase(TestCase):
    files = {"sphere.yaml": SPHERE, "notes": "not a scene\n", "s.rt": "", "rays": "0 0 -4  0 0 1\n"}

    def nothing_left(self, pattern):
        self.assertEqual(glob.glob(pattern) + glob.glob(f".{pattern}"), [])


class Commands(CliTestCase):
    def test_help_and_version(self):
        self.assertRegex(self.glint("--help").stdout, "(?m)^usage: glint")
        self.glint("help")
        self.assertRegex(self.glint("--version").stdout, r"^glint \d+\.\d+")
        for command in "render", "trace", "check", "devices":
            self.assertRegex(self.glint(f"{command} --help").stdout, f"(?m)^usage: glint {command}")

    def test_wrong_command_lines(self):
        os.mkdir("folder")
        for pattern, commands in WRONG_COMMAND_LINES:
            for command in alternatives(commands):
                with self.subTest(command):
                    self.refuses(command, pattern)

    def test_help_lists_the_precisions_that_are_accepted(self):
        for command, arguments in PRECISION_COMMANDS.items():
            line = re.search("(?m)^ *--precision .*$", self.glint(f"{command} --help").stdout)[0]
            listed = [name for name in PRECISIONS if re.search(rf"\b{name}\b", line.split("(default")[0])]
            accepted = [name for name in PRECISIONS
                        if "precision" not in self.refuses(f"{command} {arguments} --precision {name}", "").stderr]
            self.assertEqual(listed, accepted, command)

    def test_no_device(self):
        self.refuses("render sphere.yaml", 'device.*"toaster"', env={"GLINT_DEVICE": "toaster"})
        self.refuses("render sphere.yaml", "no OpenCL device.*pocl", env={"OCL_ICD_VENDORS": os.path.abspath("none.icd")})

    @unittest.skipUnless(os.path.exists(find_icd("pocl")), "PoCL is not installed")
    def test_pocl_without_a_cache(self):
        """Debian's PoCL has no device where it cannot write its cache."""
        process = run("devices", wrapper=("env", "-u", "POCL_CACHE_DIR"),
                      env={"XDG_CACHE_HOME": "/dev/null", "OCL_ICD_VENDORS": find_icd("pocl")})
        if process.returncode == 0:
            self.assertRegex(process.stdout, "(?m)^[0-9]")
        else:
            self.assertEqual(process.returncode, 1)
            self.assertIn("POCL_CACHE_DIR", process.stderr)


    def test_untrusted_cache(self):
        """An untrusted cache folder causes one warning, however many programs are built."""
        os.mkdir("shared")
        os.mkdir("shared/glint")
        os.chmod("shared/glint", 0o770)
        folder = os.path.abspath("shared")
        process = self.glint(f"render sphere.yaml {SMALL} -o shared.npy", env={"XDG_CACHE_HOME": folder})
        self.assertEqual(process.stderr, f"glint: warning: the kernel cache '{folder}/glint' is not used: others may access it\n")


class WrongInput(CliTestCase):
    def test_rays(self):
        for pattern, rays in WRONG_RAYS:
            with self.subTest(rays):
                write("rays", rays + "\n")
                self.refuses("trace sphere.yaml --rays rays", pattern)

    def test_array_of_rays(self):
        with open("rays.npy", "wb") as file:
            file.write(b"\x93NUMPY\x01\x00" + 200 * b"\xff\n")
        errors = self.refuses("trace sphere.yaml --rays rays.npy", r"rays\.npy: a NumPy array; rays are text").stderr
        self.assertEqual(errors.count("\n"), 1)

    def test_at_most_20_errors(self):
        write("rays", "\n".join(map(str, range(1, 100001))))
        errors = self.refuses("trace sphere.yaml --rays rays", "^rays:1:1: error: expected .*1$").stderr
        self.assertEqual(sum(line.startswith("rays:") and line[5].isdigit() for line in errors.splitlines()), 20)
        self.assertRegex(errors, "rays: many errors")

    def test_scenes(self):
        write("bad.yaml", "camera: 5\n")
        self.refuses("check bad.yaml", "^bad.yaml:1:")
        write("bad.rt", "bogus 1\n")
        self.refuses("check bad.rt", "^Error$")
        write("far.yaml", SPHERE.replace("[3, 4, -5]", "[3e20, 4, -5]"))
        for command in (f"render far.yaml {SMALL}", "check far.yaml"):
            self.refuses(command, r"light .*3e.20")
        write("bright.yaml", SPHERE.replace("[3, 4, -5]", "[3, 4, -5], color: [1e20, 1, 1], intensity: 1e20"))
        for command in (f"render bright.yaml {SMALL}", "check bright.yaml"):
            self.refuses(command, "precision single")
        self.nothing_left("*.png")


def writes_here(process):
    """Returns whether a process has a file of this folder open for writing, with a name or without."""
    for link in Path(f"/proc/{process}/fd").glob("*"):
        with contextlib.suppress(OSError):  # it may be closed meanwhile
            flags = int(re.search(r"flags:\s*(\d+)", read(f"/proc/{process}/fdinfo/{link.name}"))[1], 8)
            if os.path.dirname(os.path.realpath(link)) == os.getcwd() and flags & (os.O_WRONLY | os.O_RDWR):
                return True
    return False


class Failures(CliTestCase):
    """A failure leaves an earlier image unchanged, and nothing next to it."""

    def fails(self, arguments, status=1):
        write("old.png", "an earlier image")
        self.refuses(f"render {arguments} -o old.png", "glint: |error: ", status)
        self.assertEqual(read("old.png"), "an earlier image")
        self.nothing_left("*.??????")

    def test_mistakes(self):
        write("bad.yaml", "camera: 5\n")
        self.fails("bad.yaml")
        self.fails("sphere.yaml --bits 9")
        self.fails("sphere.yaml --size 8x6 --region 0,0,9,9")
        self.fails("sphere.yaml --device toaster")
        if os.getuid() != 0:
            os.chmod("old.png", 0o444)
            self.refuses(f"render sphere.yaml {SMALL} -o old.png", "old.png")

    @unittest.skipUnless(os.path.exists("/dev/full"), "there is no /dev/full")
    def test_full_disk(self):
        os.symlink("/dev/full", "full.png")
        self.refuses(f"render sphere.yaml {SMALL} -o full.png", "cannot write")
        os.symlink("/dev/full", "old.t.npy")
        self.fails(f"sphere.yaml {SMALL} --aov t")
        with open("/dev/full", "w", encoding="utf-8") as full:
            errors = self.glint("trace sphere.yaml --rays rays", status=2, stdout=full).stderr
        self.assertEqual(errors.count("\n"), 1)

    def test_limit_on_the_size_of_files(self):
        self.glint("render sphere.yaml --size 1000x1000 --quiet -o warm.png")  # the kernel is in the cache then
        limit = 1024 * 1024, 1024 * 1024
        self.refuses("render sphere.yaml --size 1000x1000 --quiet -o limit.ppm", r"limit\.ppm.*File too large",
                     preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit))
        self.nothing_left("*limit*")

    def test_reader_goes_away(self):
        """A message and a status, not a signal, end the program."""
        closed, writer = os.pipe()
        os.close(closed)
        self.glint("check sphere.yaml", status=2, stdout=writer)
        os.close(writer)

        write("rays", "".join(f"{i} 0 -4 0 0 1\n" for i in range(100000)))
        with subprocess.Popen(["head", "-n", "1"], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL) as head:
            errors = self.glint("trace sphere.yaml --rays rays", status=2, stdout=head.stdin).stderr
        self.assertRegex(errors, r"^glint: .*standard output: Broken pipe\n\Z")

        os.mkfifo("pipe.ppm")
        with subprocess.Popen(["head", "-c", "10", "pipe.ppm"], stdout=subprocess.DEVNULL):
            self.refuses("render sphere.yaml --size 400x300 --quiet --aov t -o pipe.ppm", r"pipe\.ppm.*Broken pipe")
        self.nothing_left("*pipe.t*")

    def test_signals(self):
        """A signal ends a long render, and a second one right after it changes nothing."""
        self.glint(f"render sphere.yaml {SMALL} -o warm.png")
        command = [PROGRAM, *"render sphere.yaml --size 20000x20000 --samples 64 -o long.png".split()]
        for signals in (signal.SIGINT,), (signal.SIGINT, signal.SIGINT), (signal.SIGTERM,), (signal.SIGHUP,):
            with self.subTest(signals):
                write("long.png", "an earlier image")
                render = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
                deadline = time.monotonic() + 120
                while not writes_here(render.pid) and render.poll() is None and time.monotonic() < deadline:
                    time.sleep(0.05)
                self.assertTrue(writes_here(render.pid), "it never began to write")
                for number in signals:
                    render.send_signal(number)
                    time.sleep(0.01)
                errors = render.communicate(timeout=120)[1]
                self.assertEqual(render.returncode, 130, errors)
                self.assertRegex(errors, "interrupted")
                self.assertIn("long.png", errors)
                self.assertEqual(read("long.png"), "an earlier image")
                self.nothing_left("long.png.*")

    def test_images_too_large(self):
        """An image that cannot fit on the disk is refused. Otherwise the first bands tell how long it takes."""
        for name in "vast.ppm", "vast.npy":
            self.refuses(f"render sphere.yaml --size 1048576x1048576 --quiet -o {name}", r"it has \d+\.0 TiB or more, and its disk has \S+ [KMGT]iB left")
        self.nothing_left("vast.*")
        os.symlink("/dev/null", "null.png")
        command = [PROGRAM, *"render sphere.yaml --size 1048576x1048576 -o null.png".split()]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as render:
            self.assertRegex(render.stderr.readline(), r"^glint: 1048576 x 1048576 pixels: about \d+ (hour|day)s and at most 3.0 TiB\n")
            render.send_signal(signal.SIGINT)
            self.assertIn("interrupted", render.communicate(timeout=120)[1])
        self.assertEqual(render.returncode, 130)

    def test_signals_before_the_render(self):
        """A signal while the scene is read ends glint like later ones. One that is ignored stays ignored."""
        os.mkfifo("slow.yaml")
        command = [PROGRAM, *f"render slow.yaml {SMALL} -o slow.png".split()]
        for number in signal.SIGINT, signal.SIGTERM, signal.SIGHUP:
            for ignored in False, True:
                with self.subTest(number=number, ignored=ignored):
                    before = signal.signal(number, signal.SIG_IGN if ignored else signal.SIG_DFL)
                    render = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
                    signal.signal(number, before)
                    with open("slow.yaml", "w", encoding="utf-8") as scene:  # waits until glint reads
                        render.send_signal(number)
                        if ignored:
                            scene.write(SPHERE)
                        else:
                            render.wait(timeout=120)
                    errors = render.communicate(timeout=120)[1]
                    self.assertEqual(render.returncode, 0 if ignored else 130, errors)
                    self.assertEqual(errors, "" if ignored else "glint: interrupted\n")
        self.nothing_left("slow.png.*")

    def test_scene_files_are_not_overwritten(self):
        write("globe.png", "P3 1 1 255 9 9 9\n")
        write("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        write("globe.yaml", SPHERE.replace("reflection: 0.1", "image: globe.png") + "  - mesh: {file: mesh.obj}\n")
        files = {name: read(name) for name in ("globe.png", "mesh.obj", "globe.yaml")}
        os.symlink("globe.yaml", "link.png")
        os.link("globe.png", "hard.t.npy")
        os.mkdir("globe")
        for arguments, path in (
            ("", "globe.png.*-o"),
            ("-o globe/../globe.png", "globe/../globe.png"),
            ("-o link.png", "link.png"),
            ("--aov normal,t -o hard.png", "hard.t.npy"),
        ):
            self.refuses(f"render globe.yaml {SMALL} {arguments}", f"would overwrite '{path}")
        self.refuses("trace globe.yaml --rays rays -o mesh.obj", "would overwrite 'mesh.obj'")
        write("a.yaml", SPHERE)
        write("b.yaml", SPHERE.replace("reflection: 0.1", "image: a.png"))
        os.link("globe.png", "a.png")
        for scenes in "a.yaml b.yaml", "b.yaml a.yaml":
            self.refuses(f"render {scenes} {SMALL}", "would overwrite 'a.png', which 'b.yaml' is read from")
            self.assertFalse(os.path.exists("b.png"))
        self.assertEqual({name: read(name) for name in files}, files)
        self.glint(f"render globe.yaml {SMALL} -o globe/other.png")
        os.remove("globe.png")
        os.mkdir("globe.png")
        self.refuses("check globe.yaml", r"^globe\.yaml:\d+:\d+: error: .*'globe\.png': not a regular file")
        os.rmdir("globe.png")
        self.refuses("check globe.yaml", r"^globe\.yaml:\d+:\d+: error: .*'globe\.png': No such file")


class Images(CliTestCase):
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
        self.refuses("render whole.yaml --camera shot.yaml --set camera.fov=9", "--set camera.fov=9: the camera is that of 'shot.yaml'")
        self.refuses("render objects.yaml --camera -", "--camera: expected the name of a file")
        write("far.yaml", "camera: {position: [0, 0, 5], look_at: [0, 0, 0], height: 1e30, shift: [1e30, 0]}\n")
        self.refuses("render objects.yaml --camera far.yaml", "does not fit precision single")
        self.refuses("render objects.yaml", "^objects.yaml:1:1: error: scene lacks 'camera'")
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


class Aovs(CliTestCase):
    def test_capture(self):
        """Each launch has a file, and names the files of its kernel's text and of its buffers by hashes of their contents."""
        self.glint(f"render sphere.yaml {SMALL} --capture launches --aov t -o image.npy")
        files = {path.name: path.read_bytes() for path in Path("launches").iterdir()}
        launches = {launch["kernel"]: launch for launch in map(json.loads, (files[name] for name in files if name.endswith(".json")))}
        self.assertEqual(sorted(launches), ["aov", "render"])
        used = set()
        for kernel, launch in launches.items():
            self.assertEqual([argument["index"] for argument in launch["arguments"]], list(range({"aov": 9, "render": 13}[kernel])))
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


class Trace(CliTestCase):
    def test_csv(self):
        rays = "# a comment\n\n0 0 -4  0 0 1\n0,5,-4, 0 0 1\n0x0p0 0 -0x1p+2 0 0 0x1p1 0 10 # hexadecimal\n"
        rays += "0 0 -4 0 0 1 0 2\n"
        expected = ["object", "t", "nx", "ny", "nz"], [[0, 3, 0, 0, -1], [None] * 5, [0, 1.5, 0, 0, -1], [None] * 5]
        self.assertEqual(csv_rows(self.glint(f"trace sphere.yaml --rays {write('rays', rays)}").stdout), expected)
        process = self.glint("trace sphere.yaml --rays - -o hits.csv --precision double", input=rays)
        self.assertEqual(process.stdout, "")
        self.assertEqual(csv_rows(read("hits.csv")), expected)

    def test_certified_refuses_what_has_no_bound(self):
        """Certified refuses what has no bound only if a material of an object has it and bounces rays."""
        ink = "absorption: {color: red}"
        for material, refused in (
            ("{fresnel: true, transmission: 1}", "fresnel"), ("{fresnel: true}", None),
            ("{conductor: gold}", "conductor"), ("{conductor: gold, reflection: 0}", None),
            (f"{{{ink}, transmission: 1}}", "absorption"), (f"{{{ink}, reflection: 0.5}}", None),
        ):
            write("glass.yaml", "camera: {position: [0, 0, 5], look_at: [0, 0, 0]}\nlights: [{point: {position: [5, 5, 5]}}]\n"
                  f"objects: [{{sphere: {{center: [0, 0, 0], radius: 1, material: {material}}}}},\n"
                  "  {sphere: {center: [2, 0, 0], radius: 1, material: {reflection: 0.1}}}]\n")  # with SPHERE's features
            command = f"render glass.yaml {SMALL} --precision certified -o glass.ppm"
            self.refuses(command, f"'{refused}', which has no error bound") if refused else self.glint(command)

    def test_certified(self):
        """A hit, a miss and a hit beyond the end are certain. A hit at the end and a tangent are uncertain."""
        write("rays", "0 0 -4 0 0 2\n0 5 -4 0 0 1\n0 0 -4 0 0 1 0 2\n0 0 -4 0 0 1 0 3\n0 1 -4 0 0 1\n")
        header, *lines = self.glint("trace sphere.yaml --rays rays --precision certified").stdout.splitlines()
        self.assertEqual(header, "object,t,nx,ny,nz,low,high,certainty")
        hit, *others = [line.split(",") for line in lines]
        self.assertEqual((hit[0], float(hit[1]), hit[-1]), ("0", 1.5, "certain"))
        self.assertTrue(1.5 - 1e-5 < float(hit[5]) <= 1.5 <= float(hit[6]) < 1.5 + 1e-5, hit)
        self.assertEqual([(row[0], row[-1]) for row in others[:2]], [("", "certain")] * 2)
        self.assertEqual([row[-3:] for row in others[2:]], [["", "", "uncertain"]] * 2)
        write("rays", "0 0 -4 0 0 1 1 2\n")
        self.refuses("trace sphere.yaml --rays rays --precision certified", "^rays:1:1: error: at certified, tmin must be 0")

    def test_directions_of_any_length(self):
        write("rays", "0 0 -4 0 0 1e20\n0 0 -4 0 0 1e-20\n0 0 -4 0 0 1e-60\n0 0 -4 0 0 3e38 0 3e-38\n0 0 -4 0 0 1\n")
        _, rows = csv_rows(self.glint("trace sphere.yaml --rays rays").stdout)
        self.assertEqual([(row[0], row[4]) for row in rows], [(0, -1)] * 5)


class Reports(CliTestCase):
    """Only JSON is on standard output. Text about times goes to standard error."""

    def test_timing(self):
        report = self.json(f"render sphere.yaml {SMALL} --timing=json")
        device, = report["by_device"]
        self.assertEqual((report["schema"], len(device["kernel_hash"]), report["size"]), (4, 16, [8, 6]))
        for key in "parse_ms render_ms encode_ms".split():
            self.assertIn(key, report)
        for key in "flatten_ms build_ms build_from_cache upload_ms busy_ms idle_ms read_backs".split():
            self.assertIn(key, device)
        self.assertEqual((device["share"], device["bands"]), (1, 1))
        self.assertEqual([launch["name"] for launch in device["launches"]], ["render"])
        process = self.glint(f"render sphere.yaml {SMALL} --timing")
        self.assertRegex(process.stderr, r"(?m)^ +launches +[0-9.]+ ms")
        self.assertEqual(process.stdout, "")

    def test_check_of_several(self):
        write("bad.yaml", "camera: 5\nlight: []\n")
        lines = SPHERE.splitlines(keepends=True)
        write("dark.yaml", "".join(lines[:2] + lines[5:]))
        process = self.glint("check sphere.yaml bad.yaml dark.yaml missing.yaml", status=1)
        self.assertEqual(process.stdout.splitlines(), [
            "sphere.yaml: 1 object, 2 lights, 1 material", "bad.yaml: 2 errors",
            "dark.yaml: 1 object, 0 lights, 1 material, 1 warning", "missing.yaml: 1 error"])
        self.assertRegex(process.stderr, "(?ms)^bad.yaml:1:9: error.*^bad.yaml:2:1: error.*dark.yaml: no lights")
        self.assertEqual(self.glint("check sphere.yaml sphere.yaml").stdout.count("\n"), 2)

    def test_check(self):
        scene = SCENES / "every_shape.yaml"
        self.assertRegex(self.glint(f"check {scene}").stdout, "objects +19: 5 sphere, 1 plane, 1 disc, 1 box")
        report = self.json(f"check {scene} --json")
        self.assertEqual(report["schema"], 1)
        self.assertGreaterEqual(len(report["features"]), 14)

    def test_sizes_that_float_cannot_hold(self):
        """A width below a trillionth of an object's distance causes a warning with the object's line, except at double."""
        write("long.yaml", SPHERE + "  - cylinder: {from: [50, 0, -1e17], to: [50, 0, 1e17], radius: 7}\n")
        line = len(read("long.yaml").splitlines())
        pattern = rf"warning: the cylinder on line {line} reaches 1e\+17 from the eye, and the width of the sphere on line \d+ is 2: precision"
        self.assertRegex(self.glint("check long.yaml").stderr, pattern)
        if need_device()["fp64"]:
            self.assertNotIn("warning", self.glint(f"render long.yaml {SMALL} --precision double --lanes 1 -o a.png").stderr)
        write("far.yaml", SPHERE + "  - cylinder: {from: [50, 0, -1e11], to: [50, 0, 1e11], radius: 7}\n")
        self.assertNotIn("warning", self.glint("check far.yaml").stderr)

    def test_devices(self):
        self.assertRegex(self.glint("devices").stdout, r"(?m)^0\*? ")
        self.assertTrue(self.json("devices --json")["devices"])


if __name__ == "__main__":
    need_device()
    main()
