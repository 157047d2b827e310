#!/usr/bin/env -S python3 -B
"""Tests the command line as a user sees it: every option, every message about a wrong one, the exit status, and what is printed
where. test_failures.py has what fails later, test_render.py the images."""
import itertools
import os
import re
import unittest

from glint import POCL, ROOT, SPHERE, TestCase, csv_rows, main, need_device, read, run, write

SMALL = "--size 8x6 --quiet"
SCENES = ROOT / "tests/scenes"
FILES = {"sphere.yaml": SPHERE, "notes": "not a scene\n", "s.rt": "", "rays": "0 0 -4  0 0 1\n"}

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
    ("^glint: see glint check --help$", "check sphere.yaml {--nonsense|-x|--set}"),
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
    ('--bits: expected 8 or 16, not "12"$', "render sphere.yaml --bits 12"),
    ("--bits is for PNG and PPM", "render sphere.yaml --bits 16 -o a.{exr|npy}"),
    ('--tone: .*"flimic".*did you mean filmic', "render sphere.yaml --tone flimic"),
    ("--exposure: expected", "render sphere.yaml --exposure {bright|1x|65|-65|nan|''}"),
    ("EXR and NPY hold linear", "render sphere.yaml -o a.{exr|npy} {--tone filmic|--exposure -1|--dither}"),
    ("--dither cannot be combined with --bits 16", "render sphere.yaml --dither --bits 16"),
    ('--transfer: .*"srbg".*did you mean srgb', "render sphere.yaml --transfer srbg"),
    ('--timing: .*"jsn".*did you mean json', "render sphere.yaml --timing=jsn"),
    ('--aov: .*"nromal".*did you mean normal', "render sphere.yaml --aov t,nromal"),
    ("--aov: expected", "render sphere.yaml --aov {t,|''}"),
    ('--precision: .*"sinlge".*did you mean single', "{render|trace --rays rays} sphere.yaml --precision sinlge"),
    ('--lanes: expected 1, 4, 8 or 16, not "[30]"', "{render|trace --rays rays} sphere.yaml --lanes {3|0}"),
    (r'device.* "(toaster|99)".*: 0 \(', "{render|trace --rays rays} sphere.yaml --device {toaster|99}"),
    (r"missing\.yaml.*No such file", "{render|trace --rays rays|check|} missing.yaml"),
    (r"sphere\.txt", "{render|trace --rays rays|check} sphere.txt"),
    ("notes: the name of a scene must end in", "{render|} notes"),
    ('unknown command "folder"', "folder"),
    (r"one scene, but 'b\.yaml' is a second", "trace --rays rays sphere.yaml b.yaml"),
    ("cannot both be read from standard input", "trace - --rays -"),
    ("the output is CSV", "trace sphere.yaml --rays rays -o {hits.npy|hits.PNG}"),
    ("no-rays.*No such file", "trace sphere.yaml --rays no-rays"),
    (r"\.png, \.ppm, \.exr or \.npy", "render sphere.yaml -o {image.jpg|image.PNGX|image.|folder}"),
    (r"\.png, \.ppm, \.exr or \.npy", "render sphere.yaml -o notes --skip-existing {|--aov t}"),
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
    ("the direction is not finite", "0 0 -4 0 0 inf"),
    ("^rays:1:1: error: tmax must be above tmin, but 1 is not above 5$", "0 0 5 0 0 -1 5 1"),
    ("direction", "0 0 -4 0 -0 0"),
]


def alternatives(command):
    parts = re.split(r"\{(.*?)\}", command)
    choices = [part.split("|") if index % 2 else [part] for index, part in enumerate(parts)]
    return ["".join(words) for words in itertools.product(*choices)]


class Commands(TestCase):
    files = FILES

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

    def test_program_that_cannot_be_started(self):
        unknown = r'glint: unknown command "rendr"; did you mean render\?\n\Z'
        write("file", "")
        self.refuses("rendr", rf"\A{unknown}", env={"PATH": os.path.abspath("file")})
        write("glint-rendr", "")
        self.refuses("rendr", r"\Aglint: cannot start glint-rendr: Permission denied\n\Z", env={"PATH": f"{os.getcwd()}:/none"})
        os.symlink("loop", "loop")
        os.chmod(write("glint-loop", "#!./loop\n"), 0o755)
        self.refuses("loop", r"\Aglint: cannot start glint-loop: .*\n\Z", env={"PATH": os.getcwd()})
        self.refuses("locate", r"\Aglint: glint locate needs .*\n\Z", env={"PATH": os.getcwd()})

    def test_help_lists_the_precisions_that_are_accepted(self):
        for command, arguments in PRECISION_COMMANDS.items():
            line = re.search("(?m)^ *--precision .*$", self.glint(f"{command} --help").stdout)[0]
            listed = [name for name in PRECISIONS if re.search(rf"\b{name}\b", line.split("(default")[0])]
            accepted = [name for name in PRECISIONS
                        if "precision" not in self.refuses(f"{command} {arguments} --precision {name}", "").stderr]
            self.assertEqual(listed, accepted, command)

    def test_no_device(self):
        self.refuses("render sphere.yaml", 'device matches GLINT_DEVICE "toaster"', env={"GLINT_DEVICE": "toaster"})
        self.refuses("render sphere.yaml", "no OpenCL device.*pocl", env={"OCL_ICD_VENDORS": os.path.abspath("none.icd")})

    @unittest.skipUnless(os.path.exists(POCL["OCL_ICD_VENDORS"]), "PoCL is not installed")
    def test_pocl_without_a_cache(self):
        """Debian's PoCL has no device where it cannot write its cache."""
        process = run("devices", wrapper=("env", "-u", "POCL_CACHE_DIR"),
                      env=POCL | {"XDG_CACHE_HOME": "/dev/null"})
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


class WrongInput(TestCase):
    files = FILES

    def test_rays(self):
        for pattern, rays in WRONG_RAYS:
            with self.subTest(rays):
                write("rays", rays + "\n")
                self.refuses("trace sphere.yaml --rays rays", pattern)

    def test_array_of_rays(self):
        with open("rays.npy", "wb") as file:
            file.write(b"\x93NUMPY\x01\x00" + 200 * b"\xff\n")
        errors = self.refuses("trace sphere.yaml --rays rays.npy", r"'rays\.npy' is a NumPy array, but rays must be text").stderr
        self.assertEqual(errors.count("\n"), 1)

    def test_at_most_20_errors(self):
        write("rays", "\n".join(map(str, range(1, 100001))))
        errors = self.refuses("trace sphere.yaml --rays rays", "^rays:1:1: error: expected .*1$").stderr
        self.assertEqual(sum(line.startswith("rays:") and line[5].isdigit() for line in errors.splitlines()), 20)
        self.assertRegex(errors, "rays: error: only the first 20 errors are reported; there may be more")

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


class Trace(TestCase):
    files = FILES

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
            self.refuses(command, fr"certified has no error bounds for '{refused}' \(sphere on line 3\); use another precision") if refused else self.glint(command)

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


class Reports(TestCase):
    """Only JSON is on standard output. Text about times goes to standard error."""

    files = FILES

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
        self.assertRegex(process.stderr, "(?ms)^bad.yaml:1:9: error.*^bad.yaml:2:1: error.*dark.yaml: warning: the scene has no lights")
        self.assertEqual(self.glint("check sphere.yaml sphere.yaml").stdout.count("\n"), 2)

    def test_check(self):
        scene = SCENES / "every_shape.yaml"
        self.assertRegex(self.glint(f"check {scene}").stdout, "objects +20: 5 sphere, 1 plane, 1 disc, 1 box")
        report = self.json(f"check {scene} --json")
        self.assertEqual(report["schema"], 1)
        self.assertGreaterEqual(len(report["features"]), 14)

    def test_check_of_large_images(self):
        """Like the other commands that read scenes, check refuses images with more than --max-pixels, and accepts those with fewer."""
        write("large.ppm", "P3 3 2 255 " + 18 * "0 ")
        write("image.yaml", SPHERE + "  - sphere: {center: [2, 0, 0], radius: 1, material: {image: large.ppm}}\n")
        self.glint("check image.yaml --max-pixels 6")
        self.refuses("check image.yaml --max-pixels 5", "the image has 3 x 2 pixels")

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
        self.assertRegex(self.glint("devices").stdout, r"(?m)^ *0  ")
        self.assertTrue(self.json("devices --json")["devices"])


if __name__ == "__main__":
    need_device()
    main()
