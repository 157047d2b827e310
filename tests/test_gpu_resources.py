#!/usr/bin/env -S python3 -B
"""Checks that kernels compiled for GPUs without one (tools/kernels/gpu-resources) need no more private memory than the scene's pending
children and bounces, and spill nothing."""
import json
import subprocess

import glint

# Bytes of private memory per thread, and waves of 16 on gfx1030.
MOST_STACK = {"spheres16": 0, "bunny": 512, "mirror-glass": 384}
LEAST_WAVES = {"spheres16": 10, "bunny": 8, "mirror-glass": 6}
SCENES = list(MOST_STACK) if glint.IS_LONG else ["bunny"]


class GpuResources(glint.TestCase):
    def test_single_precision_stays_within_its_bounds(self):
        command = [glint.ROOT / "tools/kernels/gpu-resources", "--json", *SCENES]
        rows = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
        self.assertEqual([row["scene"] for row in rows], SCENES)
        for row in rows:
            for target in filter(None, (row["gfx1030"], row["sm_90"])):
                self.assertLessEqual(target["stack_bytes"], MOST_STACK[row["scene"]], row)
                self.assertEqual(target["spilled_bytes"], 0, row)
            # The stack holds the arrays of the kernel, whatever compiles it, and a kernel spills above 255 registers. The
            # number of waves depends on how each version allocates registers; these were measured with 15.
            if CLANG == 15:
                self.assertGreaterEqual(row["gfx1030"]["waves"], LEAST_WAVES[row["scene"]], row)


if __name__ == "__main__":
    CLANG = glint.need_clang("gpu-resources")
    glint.main()
