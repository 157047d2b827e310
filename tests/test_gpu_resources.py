#!/usr/bin/env -S python3 -B
"""What the kernels need of GPUs, compiled for them without one (tools/gpu-resources): no more private memory than the
scene's pending children and bounces, nothing spilled."""
import json
import os
import shutil
import subprocess

import glint

# Bytes of private memory per thread, and waves of 16 on gfx1030.
MOST_STACK = {"spheres16": 0, "bunny": 512, "mirror-glass": 384}
LEAST_WAVES = {"spheres16": 10, "bunny": 8, "mirror-glass": 6}
SCENES = list(MOST_STACK) if glint.IS_LONG else ["bunny"]


class GpuResources(glint.TestCase):
    def test_single_precision_stays_within_its_bounds(self):
        build = os.environ.get("BUILD", glint.PROGRAM.parent)
        subprocess.run([os.environ.get("MAKE", "make"), "-s", f"BUILD={build}", "kernel_text"], cwd=glint.ROOT, check=True)
        command = [glint.ROOT / "tools/gpu-resources", "--json", *SCENES]
        rows = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
        self.assertEqual([row["scene"] for row in rows], SCENES)
        for row in rows:
            for target in filter(None, (row["gfx1030"], row["sm_90"])):
                self.assertLessEqual(target["stack_bytes"], MOST_STACK[row["scene"]], row)
                self.assertEqual(target["spilled_bytes"], 0, row)
            self.assertGreaterEqual(row["gfx1030"]["waves"], LEAST_WAVES[row["scene"]], row)


if __name__ == "__main__":
    if glint.IS_SANITIZED:
        glint.skip_all("the plain build's kernels are the same")
    if not shutil.which("clang-15") or not os.path.exists("/usr/lib/clc/amdgcn--amdhsa.bc"):
        glint.skip_all("no clang-15 with libclc-15")
    glint.main()
