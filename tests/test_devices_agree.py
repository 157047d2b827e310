#!/usr/bin/env -S python3 -B
"""Checks that every OpenCL implementation gives the same bits at `strict`, for images and traces of a scene with every shape,
every light, highlights and checkers. Each is compared at 4 lanes with PoCL at 1, and with GLINT_LONG_TESTS=1 at both
everywhere, for more pixels and rays. Implementations that are not installed are skipped. INTEL_OPENCL_RT names a folder that
holds Intel's CPU runtime (libintelocl.so, for one from the package intel-opencl-rt of PyPI).

rusticl on llvmpipe (Mesa 22.3) has no fused multiply-add, and its compiler inlines that of the kernels everywhere. It
renders one type of shape at a time under all lights, 5 to 15 seconds each. Here these are discs (test_several_devices.py has
a sphere); with GLINT_LONG_TESTS=1 all of them, and the whole scene, which takes the compiler 17 seconds and 1.8 GB.

run_tests: sanitize-long-only"""
import math
import os
import shlex
import shutil
import unittest
from pathlib import Path

from glint import IS_LONG, IS_SANITIZED, ROOT, TestCase, find_icd, has_device, main, read, skip_all, write

SCENE = ROOT / "tests/scenes/every_shape.yaml"
WIDTH, HEIGHT, RAY_COUNT = (32, 18, 640) if IS_LONG else (16, 9, 160)
RUSTICL_SHAPES = "plane disc box sphere triangle cylinder cone torus paraboloid superellipsoid".split() + [""] if IS_LONG else ["disc"]
POCL = {"env": {"OCL_ICD_VENDORS": find_icd("pocl")}}
RUSTICL = {"env": {"OCL_ICD_VENDORS": find_icd("rusticl"), "RUSTICL_ENABLE": "llvmpipe"}}
# optimized, LLVM leaves calls that Oclgrind 21.10 does not know
OCLGRIND = {"wrapper": ("oclgrind", "--build-options", "-cl-opt-disable")}


def rays():
    """Returns rays from all around at the scene's middle, with zeros of either sign among the directions."""
    around, across = RAY_COUNT * 4 // 5, RAY_COUNT // 10
    for i in range(around):
        angle, y, far = i * 2.399963, 1 - (2 * i + 1) / around, 3 + i % 7 * 4
        x, z = (f(angle) * math.sqrt(1 - y * y) for f in (math.cos, math.sin))
        yield x * far, 1 + y * far, z * far, -x + 0.05 * math.sin(i), -y + 0.04 * math.cos(i), -z
    for i in range(across):
        yield i / across * 12.8 - 6.4, 0.5, -20, 0.0 if i % 2 else -0.0, 0, 1
    for i in range(across):
        yield i / across * 12.8 - 6.4, 20, math.sin(i) * 3, 0, -1, -0.0


class DevicesAgree(TestCase):
    def pixels(self, implementation, scene=SCENE, lanes=1, options=""):
        """Returns the bytes of each pixel."""
        command = f"render {scene} --lanes {lanes} --size {WIDTH}x{HEIGHT} --precision strict --quiet -o image.npy {options}"
        self.glint(command, **implementation)
        data = Path("image.npy").read_bytes()
        return [data[i : i + 12] for i in range(len(data) - WIDTH * HEIGHT * 12, len(data), 12)]

    def trace(self, implementation, lanes=1):
        write("rays", "".join(" ".join(f"{number:.9g}" for number in ray) + "\n" for ray in rays()))
        return self.glint(f"trace {SCENE} --rays rays --precision strict --lanes {lanes}", **implementation).stdout

    def check_image(self, what, implementation, scene=SCENE, lanes=1, options=""):
        found = self.pixels(implementation, scene, lanes, options)
        if "path" in options:
            os.rename("image.path.npy", "found.path.npy")
        pairs = zip(found, self.pixels(POCL, scene, options=options))
        if "path" in options:
            self.assertSameBytes("found.path.npy", "image.path.npy")
        differing = [(i % WIDTH, i // WIDTH) for i, (one, other) in enumerate(pairs) if one != other]
        self.assertEqual(differing, [], f"{what}: these pixels (x, y) are not PoCL's")

    def check(self, implementation):
        if not has_device(**implementation):
            self.skipTest("not installed")
        for lanes in (1, 4) if IS_LONG else (4,):
            self.check_image(f"{lanes} lanes", implementation, lanes=lanes)
            self.assertEqual(self.trace(implementation, lanes), self.trace(POCL), f"traces at {lanes} lanes")

    def test_pocl(self):
        hits = sum(line[0].isdigit() for line in self.trace(POCL).splitlines())
        self.assertTrue(0.3 * RAY_COUNT < hits < RAY_COUNT, f"{hits} of {RAY_COUNT} rays hit")
        if IS_LONG:
            self.check(POCL)  # else test_variants compares lanes

    @unittest.skipUnless(IS_LONG, "PoCL links unoptimized kernels slowly")
    def test_unoptimized(self):
        """PoCL without optimization renders every scene alike. With transmission PoCL 3.1 takes minutes to link a kernel, because
        it follows each path through the calls."""
        os.mkdir("cache")
        cache = {"XDG_CACHE_HOME": os.path.abspath("cache"), "POCL_CACHE_DIR": os.path.abspath("cache")}
        unoptimized = {"env": POCL["env"] | cache | {"POCL_EXTRA_BUILD_FLAGS": "-cl-opt-disable"}}
        for scene in sorted([*ROOT.glob("scenes/*.*"), *ROOT.glob("tests/scenes/*.yaml")]):
            for bvh in ("off", "on") if "transmission" not in read(scene) else ():
                self.check_image(f"{scene.name}, BVH {bvh}", unoptimized, shlex.quote(str(scene)), options=f"--bvh {bvh}")

    @unittest.skipIf(IS_SANITIZED or not shutil.which("oclgrind"), "Oclgrind is not installed, or the build is sanitized")
    def test_oclgrind(self):
        self.check(OCLGRIND)

    @unittest.skipIf(IS_SANITIZED, "the build is sanitized")
    def test_intel(self):
        library = next(Path(os.environ.get("INTEL_OPENCL_RT", "/none")).rglob("libintelocl.so"), None)
        self.check({"env": {"OCL_ICD_VENDORS": os.path.abspath(write("intel.icd", f"{library}\n"))}})

    @unittest.skipIf(IS_SANITIZED, "the build is sanitized")
    def test_rusticl(self):
        if not has_device(**RUSTICL):
            self.skipTest("not installed")
        head, objects = read(SCENE).split("objects:\n")
        for shape in RUSTICL_SHAPES:
            kept = [line for line in objects.splitlines() if line.startswith(f"  - {shape}")]
            self.assertTrue(kept, shape)
            scene = write("apart.yaml", "\n".join([head + "objects:", *kept]))
            # the compiler of Mesa 22.3 crashes in the kernel of paths at loops over anything but an array
            options = "--aov path" if shape == RUSTICL_SHAPES[-1] else ""
            self.check_image(shape, RUSTICL, scene, options=options)


if __name__ == "__main__":
    if not has_device(**POCL):
        skip_all("PoCL is not here to compare with")
    main()
