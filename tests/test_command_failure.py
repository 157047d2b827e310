#!/usr/bin/env -S python3 -B
"""Tests what a command prints, writes and exits with if an OpenCL call fails or its driver crashes."""
import os
import unittest
from pathlib import Path

from glint import IS_SANITIZED, POCL, ROOT, SPHERE, TWO, TestCase, faults, file_size, has_device, main, need_device, preloaded, read, shim_build, write

RENDER = "render sphere.yaml --size 8x8 -o image.png"
FAILS = r"CL_OUT_OF_RESOURCES \(-5\) on "
LAUNCH = rf"clEnqueueNDRangeKernel: {FAILS}"


class CommandFailure(TestCase):
    files = {"sphere.yaml": SPHERE}

    def ends(self, command, env, status, pattern):
        """Drivers may print warnings first, as PoCL 3.1 does on arm64."""
        errors = self.glint(command, status, env=env).stderr
        self.assertRegex(errors, rf"(?m)^glint: {pattern}")
        return errors

    def test_commands(self):
        for command in (RENDER, "trace sphere.yaml --rays /dev/null", "bench sphere.yaml --size 8x8",
                        "accuracy sphere.yaml --size 8x8", "verify P1"):
            for call in "clCreateContext", "clCreateCommandQueue", "clCreateBuffer":
                with self.subTest(command=command, call=call):
                    self.ends(command, faults(f"{call}@0 fail"), 2, f"{call}: {FAILS}")
                    self.assertFalse(os.path.exists("image.png"))

    @unittest.skipUnless(has_device(env=POCL), "PoCL is not installed")
    def test_several_devices(self):
        """If one of two devices fails, or the scene does not fit it, there is a warning and the same image. If both fail, or the
        scene does not fit a device that was named, there is an error."""
        command = "render sphere.yaml --size 64x48 --quiet"
        self.glint(f"{command} -o one.npy", env=TWO)
        other = {"POCL_DEVICES": "basic pthread"}
        first = self.json("devices --json", env=POCL | other)["devices"][0]["name"]
        tiny = other | preloaded(shim_build("limits.so", read(ROOT / "tests/shims/limits.c"), "-ldl", "-pthread"),
                                 GLINT_LIMITS="buffer=1", GLINT_LIMITED=first)
        for env, pattern in ((faults("clEnqueueNDRangeKernel@0 fail"), LAUNCH), (faults("clCreateContext@0 fail"), f"clCreateContext: {FAILS}"),
                             (tiny, "the scene needs ")):
            errors = self.ends(f"{command} --device all -o all.npy", TWO | env, 0, f"warning: .*{pattern}")
            self.assertIn("; the other devices render its share\n", errors)
            self.assertSameBytes("one.npy", "all.npy")
            os.remove("all.npy")
        self.ends(f"{command} --device all -o all.npy", TWO | faults("clEnqueueNDRangeKernel fail"), 2, LAUNCH)
        self.ends(f"{command} --device 0,1 -o all.npy", TWO | tiny, 1, "error: .*the scene needs ")
        self.assertFalse(os.path.exists("all.npy"))

    def test_release_after_the_output(self):
        """A complete image is written whatever a release returns."""
        self.ends(RENDER, faults("clEnqueueUnmapMemObject@0 fail"), 0, f"warning: clEnqueueUnmapMemObject: {FAILS}")
        self.assertGreater(file_size("image.png"), 0)

    @unittest.skipIf(IS_SANITIZED, "sanitizers handle crashes")
    def test_crashes(self):
        """A driver that crashes is named with its call. If the output is complete, this is a warning."""
        empty = {"XDG_CACHE_HOME": str(Path("cache").resolve()), "POCL_CACHE_DIR": str(Path("cache").resolve())}  # no program comes from it
        for call, status in ("clGetPlatformIDs", 2), ("clBuildProgram", 2), ("clWaitForEvents", 2), ("clGetProgramInfo", 0):
            for act, what in ("crash", "crashed"), ("abort", "aborted"), ("assertion", "aborted"):
                with self.subTest(call=call, act=act):
                    write("image.png", "")
                    warning = "" if status else "warning: "
                    self.ends(RENDER, faults(f"{call}@0 {act}") | empty, status, f"{warning}{call}: the OpenCL driver {what}")
                    self.assertEqual(file_size("image.png") > 0, status == 0)


if __name__ == "__main__":
    need_device()
    main()
