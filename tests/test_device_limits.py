#!/usr/bin/env -S python3 -B
"""Checks that glint works within each limit of devices, with the same bits, or refuses the device with the reason.
tests/shims/limits.c reports and enforces the limits.

run_tests: first"""
import json
import os
import re
from pathlib import Path

from glint import IS_LONG, IS_SANITIZED, POCL, ROOT, SPHERE, TestCase, main, need_device, need_pocl, npy_read, png_read, read, shim_build, skip_all, write

RENDER = "render sphere.yaml --quiet --size 320x200 -o image.npy"
STRICT = f"{RENDER} --precision strict --lanes 1"
TRACE = "trace sphere.yaml --rays rays.txt --precision strict --lanes 1"
# In a cache without the kernel. Its lanes have their functions out of line in any case.
UNCACHED = f"{RENDER} --lanes 16"
ALL_AOVS = "t,normal,position,object,shadow,ray,path,color"
MEBI = 1 << 20
SCALE = 4 if IS_LONG else 1  # of the images that need many bands or launches

# Limits, command: the same bits as without the limits, or of verify, which prints times, success.
WORKS = (
    ("embedded", f"{RENDER} --precision single"),
    ("no-double,constant=16384,first=4096", f"{STRICT} --size 8x8 --samples 100"),
    (f"address=32,memory={8192 * MEBI}", STRICT),
    ("units=0", f"{RENDER} --size 1280x4 --samples 256"),  # more samples in a row than in the first band
    ("group=1", f"{STRICT} --aov {ALL_AOVS}"),
    ("group=12,buffers=8", f"{STRICT} --aov {ALL_AOVS}"),
    ("group=12,buffers=8", TRACE),
    # a passport's results alone need 4 MiB
    (f"memory={16 * MEBI},buffer={4 * MEBI}", f"{STRICT} --size 1920x{270 * SCALE} --aov {ALL_AOVS}"),
    (f"memory={32 * MEBI},buffer={8 * MEBI}", f"{STRICT} --size 1920x512 --work-group 1x256 --aov {ALL_AOVS}"),
    (f"group=1,constant=16384,memory={64 * MEBI},buffer={16 * MEBI}", f"{RENDER} --precision certified --samples 2"),
    ("buffers=8", f"{RENDER} --precision certified --samples 2 --aov t,path,flag"),
    # the watchdog: no launch grows more than fourfold
    ("first=4096", f"{STRICT} --size {960 * SCALE}x400 --aov {ALL_AOVS}"),
    ("first=4096", f"{RENDER} --precision certified --size {960 * SCALE}x600 --samples 2"),
    ("first=4096", TRACE),
    ("embedded", "verify S1"),
    ("buffers=8,first=4096", f"verify S1 {'M1' if IS_LONG else ''} --precision strict --lanes 1"),
)
# Limits: warned of, with the same bits. The statuses are CL_OUT_OF_HOST_MEMORY and CL_OUT_OF_RESOURCES.
INLINED = ("build=6", "kernel=5") if IS_LONG else ("build=6",)
# Limits, command, exit status, message.
REFUSED = (
    ("embedded", f"{RENDER} --precision strict", 1, "precision strict: the device .* has the embedded profile"),
    ("embedded", f"{RENDER} --precision certified", 1, "precision certified: the device .* has the embedded profile"),
    ("embedded", "verify S1 --precision strict", 1, "precision strict: the device .* has the embedded profile"),
    ("no-double", "verify S1 --precision double", 1, "precision double: the device .* has no 64-bit floating point"),
    ("toward-zero", RENDER, 1, "unusable: float arithmetic rounds toward zero only"),
    ("no-infinity", RENDER, 1, "unusable: float arithmetic has no infinity and no NaN"),
    ("no-double", f"{RENDER} --precision double", 1, "precision double: the device .* has no 64-bit floating point"),
    (f"buffer={4 * MEBI}", "render large.yaml -o image.npy --quiet", 1, "the scene needs .* at most 4.0 MiB in one buffer"),
    (f"memory={16 * MEBI}", "render large.yaml -o image.npy --quiet", 1, "the scene needs .* the device .* has 16.0 MiB"),
    ("build=6", UNCACHED, 2, "clBuildProgram: CL_OUT_OF_HOST_MEMORY .*: the driver's compiler ran out of memory"),
    ("build=5", UNCACHED, 2, "clBuildProgram: CL_OUT_OF_RESOURCES .* ran out of memory or time"),
    ("build=11", UNCACHED, 2, "clBuildProgram: CL_BUILD_PROGRAM_FAILURE .* does not accept the kernel"),
    ("kernel=5", UNCACHED, 2, "clCreateKernel: CL_OUT_OF_RESOURCES .*: the kernel needs more registers"),
    ("kernel=6", UNCACHED, 2, "clCreateKernel: CL_OUT_OF_HOST_MEMORY .*: the driver ran out of memory"),
    ("kernel=46", UNCACHED, 2, "clCreateKernel: CL_INVALID_KERNEL_NAME .*: the driver's build left the kernel out"),
    # limits that the device does not report
    ("buffers=7", STRICT, 2, "clEnqueueNDRangeKernel: CL_OUT_OF_RESOURCES .* on "),
    ("first=1000", STRICT, 2, "clEnqueueNDRangeKernel: CL_OUT_OF_RESOURCES .* on "),
)


def large_mesh(path, side=320):
    """Writes a square of 2 * side * side triangles."""
    vertices = [f"v {x / side - 0.5} {y / side - 0.5} 0" for y in range(side + 1) for x in range(side + 1)]
    corners = (y * (side + 1) + x + 1 for y in range(side) for x in range(side))
    faces = (f"f {c} {c + 1} {c + side + 2}\nf {c} {c + side + 2} {c + side + 1}" for c in corners)
    write(path, "\n".join([*vertices, *faces, ""]))


class DeviceLimits(TestCase):
    files = {"sphere.yaml": SPHERE, "large.yaml": SPHERE + "  - mesh: {file: large.obj}\n",
             "rays.txt": "".join(f"0 0 -4  {i / 40000 - 0.5} {i % 200 / 200 - 0.5} 1\n" for i in range(40000))}

    def outputs(self, command, limits=None):
        """Returns the command's standard output and files, on the device with the limits."""
        env = POCL if limits is None else POCL | {"LD_PRELOAD": self.shim, "GLINT_LIMITS": limits}
        process = self.glint(command, env=env)
        files = {path.name: path.read_bytes() for path in sorted(Path().glob("image*"))}
        for name in files:
            os.unlink(name)
        return process.stdout, files

    @classmethod
    def setUpClass(cls):
        path = os.path.join(os.environ.get("TMPDIR", "/tmp"), f"glint-limits-{os.getpid()}.so")
        cls.shim = shim_build(path, read(ROOT / "tests/shims/limits.c"), "-ldl", "-pthread")
        cls.addClassCleanup(os.unlink, path)

    def test_works_within(self):
        for limits, command in WORKS:
            with self.subTest(limits=limits, command=command):
                found = self.outputs(command, limits)
                self.assertTrue(command.startswith("verify") or found == self.outputs(command))

    def test_is_built_out_of_line(self):
        command = f"render {ROOT}/tests/scenes/mirror-balls.yaml --size 64x48 --lanes 1 --precision strict --quiet --aov path,t"
        report = self.json(f"{command} -o one.npy --timing=json", env=POCL)
        self.assertFalse(report["by_device"][0]["build_out_of_line"])
        for limits in INLINED:
            with self.subTest(limits=limits):
                cache = {"XDG_CACHE_HOME": os.path.abspath(limits)}  # elsewhere the kernel would be found
                limited = POCL | cache | {"LD_PRELOAD": self.shim, "GLINT_LIMITS": limits}
                for is_cached in False, True:
                    process = self.glint(f"{command} -o image.npy --timing=json", env=limited)
                    self.assertRegex(process.stderr, "warning: the compiler of the device .* functions out of line")
                    device = json.loads(process.stdout)["by_device"][0]
                    self.assertTrue(device["build_out_of_line"])
                    self.assertEqual(device["build_from_cache"], is_cached)
                    for end in "npy", "path.npy", "t.npy":
                        self.assertSameBytes(f"one.{end}", f"image.{end}")
                self.glint(f"{command} -o image.png", env=limited)
                self.assertEqual(png_read("image.png")[2]["Kernel"], device["kernel_hash"])

    def test_is_refused(self):
        large_mesh("large.obj")
        for limits, command, status, message in REFUSED:
            with self.subTest(limits=limits, command=command):
                cache = {"XDG_CACHE_HOME": os.path.abspath("empty")} if command == UNCACHED else {}
                self.refuses(command, message, status, env=POCL | cache | {"LD_PRELOAD": self.shim, "GLINT_LIMITS": limits})
                self.assertFalse(os.path.exists("image.npy"))

    def test_reference_device(self):
        """A device without 64-bit floating point takes its work in double from another one, chosen or found."""
        mirrors = f"{ROOT}/tests/scenes/mirror-balls.yaml"
        certified = "--size 96x64 --samples 2 --precision certified --quiet --aov flag,path,t"
        two = POCL | {"POCL_DEVICES": "basic pthread"}
        names = [device["name"] for device in self.json("devices --json", env=two)["devices"]]
        basic, pthread = (re.match(r"[\w-]+", name)[0] for name in names)  # PoCL 3.1's, of which 6.0 makes cpu-minimal-… and cpu-…
        limited = two | {"LD_PRELOAD": self.shim, "GLINT_LIMITS": "no-double", "GLINT_LIMITED": basic}
        self.assertEqual([device["fp64"] for device in self.json("devices --json", env=limited)["devices"]], [False, True])
        self.glint(f"render {mirrors} {certified} --device {pthread} -o one.npy", env=limited)
        chosen = f'^glint: "{pthread}.*" computes in double for "{basic}.*", which has no 64-bit floating point$'
        for option, message in ("", chosen), (f"--reference-device {pthread}", "^$"), ("--reference-device 1", "^$"):
            process = self.glint(f"render {mirrors} {certified} --device {basic} {option} -o image.npy", env=limited)
            self.assertRegex(process.stderr, re.compile(message, re.MULTILINE))
            for end in "npy", "flag.npy", "path.npy", "t.npy":
                self.assertSameBytes(f"one.{end}", f"image.{end}")
        self.assertIn(1, npy_read("one.flag.npy")[2], "no pixel was rendered in double")
        report = self.json(f"render {mirrors} {certified} --device {basic} -o image.npy --timing=json", env=limited)
        self.assertRegex(report["by_device"][0]["double_by"], f"^{pthread}")
        self.assertIn("re-render", [launch["name"] for launch in report["by_device"][0]["launches"]])

        accuracy = f"accuracy {mirrors} --size 48x32 --precision single --json --seconds 0.1 --device"
        expected = self.json(f"{accuracy} {pthread} --save one", env=limited)["scenes"][0]
        found = self.json(f"{accuracy} {basic} --save other", env=limited)["scenes"][0]
        self.assertRegex(found["reference"]["device"], f"^{pthread}")
        self.assertEqual(found["reference"] | {"saved": None}, expected["reference"] | {"saved": None})
        for path in Path("one").iterdir():
            self.assertSameBytes(path, Path("other") / path.name)

        certify = f"certify {mirrors} --size 48x32 --pixels 200 --json --device {basic}"
        self.refuses(f"{certify} --precision double", "precision double: the device .* has no 64-bit floating point", env=limited)
        listed = "" if IS_LONG else "--precision certified,single"
        rows = self.json(f"{certify} {listed}", env=limited)["precisions"]
        self.assertIn("certified", [row["precision"] for row in rows if "status" not in row])
        self.assertEqual([row["precision"] for row in rows if "status" in row], ["double"] if IS_LONG else [])

        self.refuses(f"{accuracy} {basic} --reference-device {basic}", "the reference device .* has no 64-bit", env=limited)
        self.refuses(f"render {mirrors} {certified} --device {basic} --reference-device none", "no usable device matches", env=limited)
        alone = limited | {"POCL_DEVICES": "basic"}
        self.refuses(f"{accuracy} {basic}", "neither the device .* nor another one has 64-bit floating point", env=alone)
        self.refuses(f"render {mirrors} {certified} -o none.npy", "certified needs 64-bit .* no other device works in double", env=alone)
        self.refuses(f"certify {mirrors} --precision certified", "certified needs 64-bit", env=alone)
        self.refuses(TRACE.replace("strict", "certified"), "certified needs 64-bit", env=alone)

    def test_reference_for_rusticl(self):
        """rusticl hides 64-bit floating point unless told otherwise."""
        env = {"OCL_ICD_VENDORS": "/etc/OpenCL/vendors", "RUSTICL_ENABLE": "llvmpipe"}
        devices = {device["platform"]: device for device in self.json("devices --json", env=env)["devices"]}
        if "rusticl" not in devices or len(devices) < 2 or devices["rusticl"]["fp64"]:
            self.skipTest("rusticl and another OpenCL implementation are not both here")
        command = "render sphere.yaml --size 16x12 --precision certified --quiet"
        double = command.replace("certified", "double")
        self.refuses(f"{double} --device {devices['rusticl']['index']}", "no 64-bit floating point .* RUSTICL_FEATURES is fp64", env=env)
        if not IS_LONG:  # Mesa 22.3 compiles this kernel for four minutes
            return
        process = self.glint(f"{command} --device {devices['rusticl']['index']} -o image.npy", env=env)
        self.assertRegex(process.stderr, '" computes in double for "llvmpipe.* RUSTICL_FEATURES is fp64')
        self.glint(f"{command} -o one.npy", env=POCL)
        self.assertSameBytes("image.npy", "one.npy")

    def test_timers_without_times(self):
        """Every figure names the host's clock, or the device's with timers that work."""
        for limits, clock, text in ("no-timer", "host", "host's"), ("group=8192", "event", "device's"):
            env = POCL | {"LD_PRELOAD": self.shim, "GLINT_LIMITS": limits}
            report = self.json(f"{RENDER} --timing=json", env=env)["by_device"][0]
            self.assertEqual({item["clock"] for item in report["launches"]}, {clock})
            printed = self.glint(f"{RENDER} --timing", env=env).stderr
            self.assertRegex(printed, rf"launches +[0-9.]+ ms  \d+ commands?, by the {text} clock")
            self.assertEqual("by the host's clock: the runtime reports no times for events" in printed, clock == "host")
            bench = "bench sphere.yaml --size 64x64 --seconds 0.01 --precision single --no-build-times"
            self.assertEqual("    using the host's clock: " in self.glint(bench, env=env).stdout, clock == "host")
            if clock == "host":
                self.assertEqual({row["clock"] for row in self.json(f"{bench} --json", env=env)["runs"]}, {clock})

    def test_devices_of_one_name(self):
        """Two boards of a kind differ by their places on the PCI bus, by which they can be chosen."""
        places = {"khr": ("0001:{}:02.3", None), "nv": ("0000:{}:05.1", None), "amd": ("0000:{}:04.0", "Lodestar 7")}
        for extensions, (place, board) in places.items():
            env = POCL | {"POCL_DEVICES": "basic basic", "LD_PRELOAD": self.shim, "GLINT_LIMITS": extensions}
            devices = self.json("devices --json", env=env)["devices"]
            self.assertEqual([device["pci"] for device in devices], [place.format(65), place.format(66)])
            self.assertEqual([device["board"] for device in devices], [board, board])
            uuids = [bytes([0xAB, bus, *[0] * 14]).hex() for bus in (0x65, 0x66)] if extensions == "khr" else [None, None]
            self.assertEqual([device["uuid"] for device in devices], uuids)
            text = self.glint("devices", env=env).stdout
            self.assertRegex(text, f"(?m) PCI\n +0 .* {place.format(65)}\n +1 .* {place.format(66)}\n    twin 1$")
            for selector in filter(None, (devices[1]["pci"], devices[1]["pci"].partition(":")[2], devices[1]["uuid"])):
                report = self.json(f"{RENDER} --device {selector} --timing=json", env=env)
                self.assertEqual(report["by_device"][0]["pci"], devices[1]["pci"])
            if board:
                report = self.json(f"{RENDER} --device lodestar --timing=json", env=env)
                self.assertEqual((report["by_device"][0]["board"], report["by_device"][0]["pci"]), (board, devices[0]["pci"]))
        self.refuses(f"{RENDER} --device 65:00.1", 'no usable device matches "65:00.1"', env=POCL)
        device = self.json("devices --json", env=POCL)["devices"][0]
        self.assertEqual((device["board"], device["pci"], device["uuid"]), (None, None, None))

    def test_devices_report(self):
        report = self.json("devices --json", env=POCL | {"LD_PRELOAD": self.shim, "GLINT_LIMITS": "embedded,no-double,group=12"})
        device = report["devices"][0]
        self.assertEqual((device["profile"], device["fp64"], device["largest_work_group"]), ("embedded", False, 12))
        self.assertIn(device["address_bits"], (32, 64))
        limits = f"address=32,memory={8192 * MEBI},buffer={5000 * MEBI}"
        report = self.json("devices --json", env=POCL | {"LD_PRELOAD": self.shim, "GLINT_LIMITS": limits})
        sizes = [report["devices"][0][name] for name in ("address_bits", "memory_bytes", "largest_buffer_bytes")]
        self.assertEqual(sizes, [32, 2**32 - 1, 2**32 - 1])


if __name__ == "__main__":
    if IS_SANITIZED:
        skip_all("sanitizers must be loaded before a shim")
    need_device()
    need_pocl()
    main()
