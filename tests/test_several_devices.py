#!/usr/bin/env -S python3 -B
"""One image by several devices: the same bytes as by one, at `strict` even by two OpenCL implementations together.

run_tests: sanitize-long-only"""
import os
import random
import re
import shutil
import subprocess
import unittest
from pathlib import Path

from glint import IS_LONG, IS_SANITIZED, ROOT, SPHERE, TestCase, find_icd, has_device, main, png_read, run, skip_all, write

POCL = {"env": {"OCL_ICD_VENDORS": find_icd("pocl")}}
TWO = {"env": POCL["env"] | {"POCL_DEVICES": "pthread pthread"}}
OCLGRIND = Path(shutil.which("oclgrind") or "/none").parent.parent / "lib/oclgrind/liboclgrind-rt-icd.so"
FAILURES = 200 if IS_LONG else 10
SIZE, LARGE = "--size 64x48 --quiet", "--size 64x768 --quiet"
AOVS = "position", "object", "path"


class SeveralDevices(TestCase):
    def setUp(self):
        super().setUp()
        write("sphere.yaml", SPHERE)

    def mixed(self):
        """PoCL with rusticl, if it is installed, as options of run."""
        os.mkdir("vendors")
        for name in "pocl", "rusticl":
            if Path(find_icd(name)).exists():
                shutil.copy(find_icd(name), f"vendors/{name}.icd")
        implementations = {"env": {"OCL_ICD_VENDORS": os.path.abspath("vendors"), "RUSTICL_ENABLE": "llvmpipe"}}
        names = {device["platform"] for device in self.json("devices --json", **implementations)["devices"]}
        if len(names) < 2:
            self.skipTest("only one OpenCL implementation is installed")
        return implementations

    def on_all(self, command, implementations):
        """Renders by all devices into all.npy; skips where one had no band. The report."""
        report = self.json(f"{command} -o all.npy --device all --timing=json", **implementations)
        if not all(device["bands"] > 0 for device in report["by_device"]):
            self.skipTest("one device was done before another began")
        return report

    def test_two_of_one_make(self):
        for precision in "single", "strict", "double":
            command = f"render sphere.yaml {LARGE} --samples 3 --precision {precision} --aov {','.join(AOVS)}"
            self.glint(f"{command} -o one.npy", **POCL)
            report = self.on_all(command, TWO)
            for end in "npy", *(f"{aov}.npy" for aov in AOVS):
                self.assertSameBytes(f"one.{end}", f"all.{end}")
            self.assertEqual(len(report["by_device"]), 2)
            self.assertEqual(len({device["flatten_ms"] for device in report["by_device"]}), 1, "the scene was compiled more than once")
            self.assertAlmostEqual(sum(device["share"] for device in report["by_device"]), 1)
            for device in report["by_device"]:
                self.assertEqual(device["bands"], sum(launch["name"] == "aov" for launch in device["launches"]))

    @unittest.skipIf(IS_SANITIZED, "sanitizers have handlers of their own")
    def test_failing_calls(self):
        """Any OpenCL call fails, of whichever device: the right image, or an error and none."""
        subprocess.run(["cc", "-w", "-shared", "-fPIC", "-o", "chaos.so", str(ROOT / "tools/chaos.c"), "-ldl"], check=True)
        command = f"render sphere.yaml {LARGE} --samples 20 --precision strict"
        self.glint(f"{command} -o one.npy", **POCL)
        chaos = {"LD_PRELOAD": os.path.abspath("chaos.so"), "GLINT_CHAOS_LOG": os.path.abspath("calls")}
        self.glint(f"{command} --device all -o all.npy", env=TWO["env"] | chaos)
        count = int(re.search(r"^cl (\d+)", Path("calls").read_text(encoding="utf-8"), re.MULTILINE)[1])
        draw, images, dropped = random.Random(20), 0, 0
        for _ in range(FAILURES):
            Path("all.npy").unlink(missing_ok=True)
            call = draw.randrange(count)
            process = run(f"{command} --device all -o all.npy", env=TWO["env"] | chaos | {"GLINT_CHAOS": f"cl {call}"}, timeout=120)
            with self.subTest(call=call, errors=process.stderr):
                self.assertIn(process.returncode, (0, 1, 2))
                if process.returncode == 0:
                    self.assertSameBytes("one.npy", "all.npy")
                    images += 1
                    dropped += "glint: warning: the other devices go on without one: " in process.stderr
                else:
                    self.assertIn("glint: ", process.stderr)
                    self.assertFalse(os.path.exists("all.npy"))
        self.assertIn("failed ", Path("calls").read_text(encoding="utf-8"))
        # most calls are one device's, which the other replaces; few are made before both are open. A few tries show less:
        # which device makes a call depends on their speed.
        self.assertGreater(images, FAILURES / 2 if IS_LONG else 0)
        self.assertGreater(dropped, FAILURES / 4 if IS_LONG else 0)
        print(f"{FAILURES} failures of {count} calls, {images} images complete, {dropped} of them with a device less")

    def test_names(self):
        """The files' notes name both; those of one make round alike."""
        self.glint(f"render sphere.yaml {SIZE} --device 1,0 -o two.png", **TWO)
        _, _, texts, _ = png_read("two.png")
        for key in "Device", "Driver", "Lanes", "Kernel":
            one, _, other = texts[key].partition(" + ")
            self.assertEqual(one, other, key)
        self.assertNotIn("Comment", texts)
        process = self.glint(f"render sphere.yaml {SIZE} --device all --timing -o two.png", **TWO)
        self.assertEqual(process.stderr.count("% of the rows in "), 2, process.stderr)

    def test_wrong_lists(self):
        for devices, pattern in (("0,0", "device 0 .* is listed twice"), ("pthread,0", "device 0 .* is listed twice"),
                                 ("0,2", 'no usable device matches "2"'), ("0,", 'no usable device matches ""')):
            self.refuses(f"render sphere.yaml {SIZE} --device {devices}", pattern, **TWO)

    @unittest.skipIf(IS_SANITIZED, "Mesa's drivers leak")
    def test_two_makes(self):
        implementations = self.mixed()
        command = f"render sphere.yaml {LARGE} --samples 50 --precision strict"
        self.glint(f"{command} -o one.npy", **POCL)
        self.glint(f"render sphere.yaml {SIZE} --device all -o mixed.png", **implementations)
        self.assertEqual(png_read("mixed.png")[2]["Comment"], "rendered by devices that may round differently")
        # leaves the kernels in the cache
        self.glint(f"render sphere.yaml {SIZE} --precision strict --device all -o all.png", **implementations)
        self.assertNotIn("Comment", png_read("all.png")[2])
        self.on_all(command, implementations)
        self.assertSameBytes("one.npy", "all.npy")

    @unittest.skipIf(IS_SANITIZED or not OCLGRIND.exists(), "Oclgrind is not installed, or the build is sanitized")
    def test_a_slow_device(self):
        """Oclgrind is ten thousand times slower than PoCL, and gets a few rows."""
        os.mkdir("vendors")
        shutil.copy(find_icd("pocl"), "vendors/pocl.icd")
        write("vendors/oclgrind.icd", str(OCLGRIND))
        # optimised, LLVM leaves in calls that Oclgrind 21.10 does not know
        both = {"env": {"OCL_ICD_VENDORS": os.path.abspath("vendors"), "OCLGRIND_BUILD_OPTIONS": "-cl-opt-disable"}}
        command = f"render sphere.yaml {LARGE} --precision strict --no-cache"
        report = self.on_all(command, both)
        slow = next(device for device in report["by_device"] if "Oclgrind" in device["name"])
        self.assertLess(slow["share"], 0.3)
        self.glint(f"{command} -o one.npy", **POCL)
        self.assertSameBytes("one.npy", "all.npy")


if __name__ == "__main__":
    if not has_device(**POCL):
        skip_all("PoCL is not installed")
    main()
