#!/usr/bin/env -S python3 -B
"""Checks that an image by several devices has the same bytes as by one, at `strict` even by different OpenCL implementations
together. These are PoCL with rusticl, Oclgrind and Intel's CPU runtime, those that are installed. INTEL_OPENCL_RT names a
folder that holds the last one's libintelocl.so (the packages intel-opencl-rt and intel-cmplr-lib-rt of PyPI).

run_tests: sanitize-long-only"""
import os
import random
import shutil
import unittest
from pathlib import Path

from glint import IS_LONG, IS_SANITIZED, POCL, ROOT, SPHERE, TWO, TestCase, faults, find_icd, main, need_pocl, png_read, read, run, shim_build, write

INTEL = next(Path(os.environ.get("INTEL_OPENCL_RT", "/none")).rglob("libintelocl.so"), Path("/none"))
OCLGRIND = Path(shutil.which("oclgrind") or "/none").parent.parent / "lib/oclgrind/liboclgrind-rt-icd.so"
FAILURES = 200 if IS_LONG else 10
SIZE, LARGE = "--size 64x48 --quiet", "--size 64x768 --quiet"
AOVS = "position", "object", "path"
# No device launches its first band before all do, so that each has one. Passports are measured one after the other. If a device
# fails, the others continue after five minutes, and the test fails because that device has no band.
BARRIER = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t changed = PTHREAD_COND_INITIALIZER;
static void *queues[64];
static int count;
int clEnqueueNDRangeKernel(void *queue, void *b, unsigned c, void *d, void *e, void *f, unsigned g, void *h, void *i)
{
    int k = 0;
    char name[64] = "";
    const struct timespec end = {.tv_sec = time(NULL) + 300};
    ((int (*)())dlsym(RTLD_NEXT, "clGetKernelInfo"))(b, 0x1190, sizeof name, name, NULL); // CL_KERNEL_FUNCTION_NAME
    pthread_mutex_lock(&mutex);
    while (k < count && queues[k] != queue)
        k++;
    if (k == count && strcmp(name, "passport")) queues[count++] = queue;
    pthread_cond_broadcast(&changed);
    while (strcmp(name, "passport") && count < atoi(getenv("BARRIER_QUEUES")))
        if (pthread_cond_timedwait(&changed, &mutex, &end) != 0) break;
    pthread_mutex_unlock(&mutex);
    return ((int (*)())dlsym(RTLD_NEXT, "clEnqueueNDRangeKernel"))(queue, b, c, d, e, f, g, h, i);
}
"""


class SeveralDevices(TestCase):
    def setUp(self):
        super().setUp()
        write("sphere.yaml", SPHERE)

    def makes(self):
        """Returns the environment of all installed implementations together."""
        os.mkdir("vendors")
        for name in "pocl", "rusticl":
            if Path(find_icd(name)).exists():
                shutil.copy(find_icd(name), f"vendors/{name}.icd")
        for library in OCLGRIND, INTEL:
            if library.exists():
                write(f"vendors/{library.name}.icd", str(library))
        # optimized, LLVM leaves calls that Oclgrind 21.10 does not know
        options = {"RUSTICL_ENABLE": "llvmpipe", "OCLGRIND_BUILD_OPTIONS": "-cl-opt-disable"}
        together = options | {"OCL_ICD_VENDORS": os.path.abspath("vendors")}
        names = {device["platform"] for device in self.json("devices --json", env=together)["devices"]}
        if len(names) < 2:
            self.skipTest("only one OpenCL implementation is installed")
        print(f"makes: {', '.join(sorted(names))}")
        return together

    def on_all(self, command, env):
        """Renders all.npy by all devices, each of which has a band. Returns the report, unless sanitizers forbid the barrier."""
        count = len(self.json("devices --json", env=env)["devices"])
        if not IS_SANITIZED:
            barrier = shim_build("barrier.so", BARRIER)
            env = env | {"LD_PRELOAD": barrier, "BARRIER_QUEUES": str(count)}
        report = self.json(f"{command} -o all.npy --device all --timing=json", env=env)
        self.assertEqual(len(report["by_device"]), count)
        if not IS_SANITIZED:
            self.assertTrue(all(device["bands"] > 0 for device in report["by_device"]))
        return report

    def test_two_of_one_make(self):
        for precision in "single", "strict", "double":
            command = f"render sphere.yaml {LARGE} --samples 3 --precision {precision} --aov {','.join(AOVS)}"
            self.glint(f"{command} -o one.npy", env=POCL)
            report = self.on_all(command, TWO)
            for end in "npy", *(f"{aov}.npy" for aov in AOVS):
                self.assertSameBytes(f"one.{end}", f"all.{end}")
            self.assertEqual(len(report["by_device"]), 2)
            self.assertEqual(len({device["flatten_ms"] for device in report["by_device"]}), 1, "the scene was compiled more than once")
            self.assertAlmostEqual(sum(device["share"] for device in report["by_device"]), 1)
            for device in report["by_device"]:
                self.assertLessEqual(device["bands"], sum(launch["name"] == "aov" for launch in device["launches"]))

    def test_failing_calls(self):
        """If any OpenCL call of either device fails, the image is right, or there is an error and none."""
        command = f"render sphere.yaml {LARGE} --samples 20 --precision strict"
        self.glint(f"{command} -o one.npy", env=POCL)
        log = {"GLINT_FAULT_LOG": os.path.abspath("calls")}
        self.glint(f"{command} --device all -o all.npy", env=TWO | faults("opencl count") | log)
        count = int(read("calls").split()[1])
        draw, images, dropped = random.Random(20), 0, 0
        for _ in range(FAILURES):
            Path("all.npy").unlink(missing_ok=True)
            call = draw.randrange(count)
            process = run(f"{command} --device all -o all.npy", env=TWO | faults(f"opencl@{call} fail") | log, timeout=120)
            with self.subTest(call=call, errors=process.stderr):
                self.assertIn(process.returncode, (0, 1, 2))
                if process.returncode == 0:
                    self.assertSameBytes("one.npy", "all.npy")
                    images += 1
                    dropped += "; the other devices render its share" in process.stderr
                else:
                    self.assertIn("glint: ", process.stderr)
                    self.assertFalse(os.path.exists("all.npy"))
        self.assertIn("failed ", read("calls"))
        # most calls are one device's, which the other replaces; few are made before both are open. A few tries show less:
        # which device makes a call depends on their speed.
        self.assertGreater(images, FAILURES / 2 if IS_LONG else 0)
        self.assertGreater(dropped, FAILURES / 4 if IS_LONG else 0)
        print(f"{FAILURES} failures of {count} calls, {images} images complete, {dropped} of them with a device less")

    def test_names(self):
        """The files' notes name both devices, and devices of one make round alike."""
        self.glint(f"render sphere.yaml {SIZE} --device 1,0 -o two.png", env=TWO)
        _, _, texts, _ = png_read("two.png")
        for key in "Device", "Driver", "Lanes", "Kernel":
            one, _, other = texts[key].partition(" + ")
            self.assertEqual(one, other, key)
        self.assertNotIn("Comment", texts)
        process = self.glint(f"render sphere.yaml {SIZE} --device all --timing -o two.png", env=TWO)
        self.assertEqual(process.stderr.count("% of the rows in "), 2, process.stderr)

    def test_wrong_lists(self):
        for devices, pattern in (("0,0", "device 0 .* is listed twice"), ("portable,0", "device 0 .* is listed twice"),
                                 ("0,2", 'no usable device matches "2"'), ("0,", "the name of a device is empty; the devices are: 0")):
            self.refuses(f"render sphere.yaml {SIZE} --device {devices}", pattern, env=TWO)

    @unittest.skipIf(IS_SANITIZED, "drivers leak")
    def test_makes(self):
        """All makes render one image. Oclgrind, ten thousand times slower than the others, gets a few rows."""
        together = self.makes()
        command = f"render sphere.yaml {LARGE} --precision strict"
        self.glint(f"{command} -o one.npy", env=POCL)
        report = self.on_all(command, together)
        self.assertSameBytes("one.npy", "all.npy")
        for device in report["by_device"]:
            if "Oclgrind" in device["name"]:
                self.assertLess(device["share"], 0.3)

    @unittest.skipIf(IS_SANITIZED, "drivers leak")
    def test_comment(self):
        """An image's notes state whether its devices may round differently."""
        together = self.makes()
        for precision in "single", "strict":
            self.glint(f"render sphere.yaml --size 64x8 --quiet --precision {precision} --device all -o all.png", env=together)
            comment = "rendered by devices that may round differently" if precision == "single" else None
            self.assertEqual(png_read("all.png")[2].get("Comment"), comment)


if __name__ == "__main__":
    need_pocl()
    main()
