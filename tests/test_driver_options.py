#!/usr/bin/env -S python3 -B
"""Tests --work-group and --build-options: the same image, what reports name, the kernel cache, and what is refused.

run_tests: sanitize-long-only"""
import os
import unittest

from glint import IS_LONG, SPHERE, TestCase, main, need_device

PRECISIONS = (["strict"] if IS_LONG else []) + ["certified" if need_device()["fp64"] else "single"]
SMALL = "scene.yaml --size 50x35 --samples 2"


class DriverOptions(TestCase):
    files = {"scene.yaml": SPHERE}

    def launches(self, command):
        return [launch for device in self.json(f"{command} --timing=json")["by_device"] for launch in device["launches"]]

    def test_work_group_is_that_of_every_launch_and_changes_no_bit(self):
        for precision in PRECISIONS:
            common = f"render {SMALL} --precision {precision} --aov t,path"
            self.glint(f"{common} -o default.npy")
            for width, height in ((1, 1), (16, 4), (3, 5)) if IS_LONG else ((3, 5),):  # for each, kernels are compiled
                for launch in self.launches(f"{common} --work-group {width}x{height} -o fixed.npy"):
                    lists_pixels = launch["name"] == "re-render"
                    self.assertEqual(launch["local"], [width * height, 1] if lists_pixels else [width, height])
                for name in "fixed.npy", "fixed.t.npy", "fixed.path.npy":
                    self.assertSameBytes(name, name.replace("fixed", "default"))

    def test_work_group_of_many_bands(self):
        """Neighboring launches do not overlap, which would add samples twice."""
        common = "render scene.yaml --size 300x200 --samples 64 --precision single"
        self.glint(f"{common} -o default.npy")
        self.glint(f"{common} --work-group 7x3 -o fixed.npy")
        self.assertSameBytes("default.npy", "fixed.npy")

    def test_work_group_of_rays(self):
        rays = "".join(f"{i / 50} 0.1 -4 0 0 1\n" for i in range(200))
        default = self.glint("trace scene.yaml --rays -", input=rays).stdout
        self.assertEqual(default.count(",,,,"), 150)
        self.assertEqual(self.glint("trace scene.yaml --rays - --work-group 10x2", input=rays).stdout, default)

    def test_bench_and_verify(self):
        options = "--work-group 4x2"
        report = self.json("bench scene.yaml --size 50x35 --seconds 0.1 --no-build-times --launches --json "
                           f"--build-options=-DUNUSED=1 {options}")
        for row in report["runs"]:
            self.assertEqual({tuple(launch["local"]) for launch in row["launches"]}, {(4, 2)})
            self.assertRegex(row["build_options"], "^-cl-std=CL1.2 .*-DUNUSED=1$")
        self.glint(f"verify S1 --precision single {options}")

    def test_work_group_is_refused(self):
        for value in "16", "0x4", "4x", "axb", "-1x1":
            self.refuses(f"render {SMALL} --work-group={value}",
                         f'--work-group: expected WIDTHxHEIGHT, such as 16x4, .* not "{value}"')
        most = need_device()["largest_work_group"]
        for command in f"render {SMALL}", "bench scene.yaml", "verify S1", "trace scene.yaml --rays -":
            self.refuses(f"{command} --work-group {most}x2",
                         f"--work-group: {most}x2 has {2 * most} work-items; .* allows {most} in a group")

    def test_build_options_are_in_the_key_of_the_cache(self):
        cache = {"XDG_CACHE_HOME": os.getcwd()}

        def is_cached(options):
            report = self.json(f"render {SMALL} --timing=json {options}", env=cache)["by_device"][0]
            self.assertEqual(report["build_options"].endswith(" -DUNUSED=1"), "UNUSED" in options)
            return report["build_from_cache"]

        self.assertFalse(is_cached(""))
        if not is_cached(""):
            self.skipTest("the driver gives no binary")
        self.assertFalse(is_cached("--build-options=-DUNUSED=1"))
        self.assertTrue(is_cached("--build-options=-DUNUSED=1"))
        self.assertFalse(is_cached("--work-group 2x2"))
        self.assertTrue(is_cached(""))

    def test_build_options_that_the_driver_rejects(self):
        self.refuses(f"render {SMALL} --build-options=-Dget_global_id=unknown_word",
                     "(?s)clBuildProgram: .*-Dget_global_id=unknown_word\".*unknown_word.*the composed text: ", status=2)

    @unittest.skipUnless(need_device()["platform"] == "Portable Computing Language", "other compilers may keep sums exact")
    def test_build_options_reach_the_passport(self):
        """The arithmetic is measured with the options, and its passport is not that of the device without them."""
        self.refuses(f"render {SMALL} --precision strict --build-options=-cl-fast-relaxed-math", "two-sum")
        self.glint(f"render {SMALL} --precision strict")


if __name__ == "__main__":
    main()
