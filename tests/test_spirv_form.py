#!/usr/bin/env -S python3 -B
"""Checks that the kernels' SPIR-V has the form that drivers for Vulkan need, and that tools/kernels/spirv-form names the place of each
fault."""
import subprocess

import glint

SCENES = ["bunny"]
if glint.IS_LONG:
    SCENES = [f"{scene}:{precision}"
              for scene in ("spheres16", "bunny", "mirror-glass", f"{glint.ROOT}/tests/scenes/every_shape.yaml")
              for precision in ("single", "strict", "double", "certified")]
POINTER_ARRAY = """\
kernel void pointer_array(global int *a, global int *b, global int *c, uint n)
{
    global int *each[3] = {a, b, c};
    for (uint i = 0; i < n; i++)
        each[i % 3] += i;
    *each[n % 3] = 1;
}
"""
POINTER_MEMBER = """\
typedef struct {
    global int *target;
    int value;
} Entry;
kernel void pointer_member(global int *a, uint n)
{
    Entry entries[4];
    for (uint i = 0; i < 4; i++)
        entries[i] = (Entry){a + a[i], a[i + n]};
    *entries[n % 4].target = entries[(n + 1) % 4].value;
}
"""
# Pointers in an array of integers.
POINTER_BYTES = """\
kernel void pointer_bytes(global int *a, uint n)
{
    ulong words[4];
    for (uint i = 0; i < 4; i++)
        ((global int **)words)[i] = a + a[i];
    **(global int **)(words + n % 4) = words[(n + 1) % 4];
}
"""
TWO_ENTRIES = """\
kernel void two_entries(global int *a, uint n)
{
    if (n & 1) goto middle;
top:
    a[n] = a[n + 1] * 3 + a[n + 2];
    barrier(CLK_LOCAL_MEM_FENCE);
middle:
    a[n + 1] += a[n] / 3;
    if (--n) goto top;
}
"""
INVALID = """\
#pragma OPENCL EXTENSION cl_khr_int64_base_atomics : enable
kernel void invalid(global long *a)
{
    atom_add(a, 1L);
}
"""
# Nested loops, left from the inner one, and a switch; an array of integers, and a pointer that is chosen.
SOUND = """\
kernel void sound(global int *a, global int *b, uint n)
{
    int counts[4] = {0, 0, 0, 0};
    global int *chosen = n & 1 ? a : b;
    for (uint i = 0; i < n; i++)
        for (uint k = 0; k < i; k++)
            switch (a[i + k]) {
            case 1: counts[i % 4]++; break;
            case 70: chosen[k] = counts[k % 4]; break;
            case 100: return;
            default: if (chosen[k] > 5) continue; chosen[i] = k;
            }
}
"""


class SpirvForm(glint.TestCase):
    def form(self, *arguments):
        command = [glint.ROOT / "tools/kernels/spirv-form", *arguments]
        return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def check(self, text, fault):
        process = self.form(glint.write("kernel.cl", text))
        self.assertEqual(process.returncode, 1, process.stdout)
        self.assertRegex(process.stdout, rf"^kernel.cl: \d+ blocks, 1 faults\n    {fault}")

    def test_private_pointers_are_named(self):
        self.check(POINTER_ARRAY, r"\S*/kernel.cl:[356]: private variable each holds a pointer\n")
        self.check(POINTER_MEMBER, r"\S*/kernel.cl:[79]: private variable entries holds a pointer\n")
        self.check(POINTER_BYTES, r"\S*/kernel.cl:[356]: private memory holds a pointer\n")

    def test_irreducible_flow_is_named(self):
        self.check(TWO_ENTRIES, r"\S*/kernel.cl:[58]: a loop has several entries\n")

    def test_invalid_spirv_is_named(self):
        self.check(INVALID, "spirv-val: .*Int64Atomics")

    def test_sound_kernels_pass(self):
        process = self.form(glint.write("kernel.cl", SOUND))
        self.assertEqual(process.returncode, 0, process.stdout)
        self.assertRegex(process.stdout, r"^kernel.cl: \d+ blocks, 0 faults\n$")

    def test_kernels_have_no_faults(self):
        process = self.form(*SCENES)
        self.assertEqual(process.returncode, 0, process.stdout)
        for scene in SCENES:
            for kernel in "render", "aov", "path", "coverage", "trace":
                self.assertIn(f"{scene} {kernel}: ", process.stdout)


if __name__ == "__main__":
    glint.need_clang("spirv-form")
    glint.main()
