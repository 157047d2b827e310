#!/usr/bin/env -S python3 -B
"""Event times are used where they can be true. Where a runtime reports zeros or counts (rusticl, Mesa 22.3) the host's clock
is used instead, and the report says so."""
import re
import unittest

from glint import IS_SANITIZED, TestCase, find_icd, has_device, main, write

PLANE = """\
camera: {position: [0, 1, -4], look_at: [0, 0, 0], fov: 60}
ambient: [1, 1, 1]
objects: [{plane: {point: [0, 0, 0], normal: [0, 1, 0]}}]
"""


class Timing(TestCase):
    def timings(self, implementation):
        """The launches, and the report as text."""
        env = {"OCL_ICD_VENDORS": find_icd(implementation), "RUSTICL_ENABLE": "llvmpipe"}
        if not has_device(env=env):
            self.skipTest("not installed")
        command = f"render {write('plane.yaml', PLANE)} --size 320x180 --quiet"
        device, = self.json(f"{command} --timing=json", env=env)["by_device"]
        return device["launches"], self.glint(f"{command} --timing", env=env).stderr

    def test_pocl_events_are_trusted(self):
        launches, text = self.timings("pocl")
        self.assertTrue(launches)
        for launch in launches:
            self.assertTrue(0 < launch["event_ms"] <= 1.01 * launch["host_ms"] + 0.001 and "doubt" not in launch, launch)
        self.assertNotRegex(text, "render .*not trusted")

    @unittest.skipIf(IS_SANITIZED, "Mesa's drivers leak")
    def test_rusticl_events_are_not_trusted_where_they_are_next_to_nothing(self):
        """Mesa releases that report times are trusted; next to nothing, for 57600 pixels, is not."""
        launches, text = self.timings("rusticl")
        self.assertTrue(launches)
        for launch in launches:
            self.assertGreater(launch["host_ms"], 0)
            self.assertTrue(launch["doubt"] if launch["event_ms"] is None else launch["event_ms"] > 0.001, launch)
        if any(launch["event_ms"] is None for launch in launches):
            self.assertIn("the host's", text)
            self.assertGreater(float(re.search(r"(?m)^ *launches *([0-9.]+) ms", text)[1]), 0)


if __name__ == "__main__":
    main()
