#!/usr/bin/env -S python3 -B
"""Tests the passport of a device's arithmetic. A shim that edits the text of kernels or the times of events violates each
property once. `glint devices --probe` must name the property, and the precisions that rely on it must be refused. The passport
is measured once per driver."""
import hashlib
import os
import re
import sys
import tempfile

import glint
from glint import IS_LONG, SPHERE, TestCase, main, need_device, refused_precisions, shim_build, skip_all, write

# Replaces each FIND by REPLACE in the text of every kernel, where EDITS has FIND and REPLACE in turn, with \1 between them.
# TIMER changes the times of events, DRIVER the driver's version; WITHOUT_FMA takes away the claim that fma is in hardware.
# With FMA_COST the clocks of host and device stand still, except that each probe takes a time by its rounds, those of fma
# FMA_COST times that of a product and a sum, and each work-item of a sweep over mantissas SWEEP_COST nanoseconds. LAUNCHES is a
# file that gets a line for each launch.
SHIM = r"""
#define _GNU_SOURCE
#include "kernels/probes.h"
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static unsigned numbers[4]; // the probe and its rounds are the first and the third argument
static unsigned long long nanoseconds = 1000000000, launched;

static void *next(const char *name) { return dlsym(RTLD_NEXT, name); }

static char *replace(const char *text, const char *find, const char *by)
{
    size_t count = 0, length = strlen(find);
    for (const char *at = text; (at = strstr(at, find)); at += length)
        count++;
    char *result = malloc(strlen(text) + count * strlen(by) + 1), *end = result;
    for (const char *at; (at = strstr(text, find)); text = at + length) {
        end = mempcpy(end, text, at - text);
        end = stpcpy(end, by);
    }
    strcpy(end, text);
    return result;
}

void *clCreateProgramWithSource(void *context, unsigned count, const char **texts, const size_t *lengths, int *status)
{
    char *edits = strdup(getenv("EDITS") ? getenv("EDITS") : ""), *rest = edits;
    char *text = strdup(texts[0]);
    while (*rest) {
        char *find = strsep(&rest, "\1"), *by = strsep(&rest, "\1");
        if (strstr(text, "kernel void passport") && !strstr(text, find)) abort(); // the kernel has changed
        text = replace(text, find, by);
        if (!rest) break;
    }
    return ((void *(*)())next("clCreateProgramWithSource"))(context, 1, &text, NULL, status);
}

int clGetEventProfilingInfo(void *event, unsigned what, size_t size, unsigned long long *value, size_t *needed)
{
    static unsigned long long count;
    int status = ((int (*)())next("clGetEventProfilingInfo"))(event, what, size, value, needed);
    const char *timer = getenv("TIMER");
    if (value && getenv("FMA_COST")) *value = what == 0x1283 ? nanoseconds : launched; // CL_PROFILING_COMMAND_END
    if (!timer || !value) return status;
    count++;
    if (!strcmp(timer, "zero")) *value = 0;
    if (!strcmp(timer, "microseconds")) *value /= 1000;
    if (!strcmp(timer, "counter")) *value = (count + 1) / 2 * 2 + (what == 0x1283);
    if (!strcmp(timer, "backward")) *value = 4000000000000000 - *value;
    return status;
}

int clGetDeviceInfo(void *device, unsigned what, size_t size, char *value, size_t *needed)
{
    const char *driver = getenv("DRIVER");
    if (!driver || what != 0x102D) { // CL_DRIVER_VERSION
        int status = ((int (*)())next("clGetDeviceInfo"))(device, what, size, value, needed);
        if (getenv("WITHOUT_FMA") && what == 0x101B && value) // CL_DEVICE_SINGLE_FP_CONFIG
            *(unsigned long long *)value &= ~32ull; // CL_FP_FMA
        return status;
    }
    if (needed) *needed = strlen(driver) + 1;
    if (value) strcpy(value, driver);
    return 0;
}

int clSetKernelArg(void *kernel, unsigned at, size_t size, const void *value)
{
    if (at < 4 && size == sizeof *numbers) memcpy(&numbers[at], value, size);
    return ((int (*)())next("clSetKernelArg"))(kernel, at, size, value);
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
    if (clock != CLOCK_MONOTONIC || !getenv("FMA_COST"))
        return ((int (*)(clockid_t, struct timespec *))next("clock_gettime"))(clock, now);
    *now = (struct timespec){nanoseconds / 1000000000, nanoseconds % 1000000000};
    return 0;
}

int clEnqueueNDRangeKernel(void *a, void *b, unsigned c, void *d, void *e, void *f, unsigned g, void *h, void *i)
{
    FILE *file = getenv("LAUNCHES") ? fopen(getenv("LAUNCHES"), "a") : NULL;
    char name[64] = "";
    ((int (*)())next("clGetKernelInfo"))(b, 0x1190, sizeof name, name, NULL); // CL_KERNEL_FUNCTION_NAME
    if (file) fprintf(file, "%s\n", name);
    if (file) fclose(file);
    launched = nanoseconds;
    if (getenv("FMA_COST"))
        nanoseconds += 10000 + 1000ull * numbers[2] * (numbers[0] == PROBE_TIME_FMA ? atoi(getenv("FMA_COST")) : 1);
    if (getenv("FMA_COST") && getenv("SWEEP_COST") && numbers[0] >= PROBE_SWEEP_RECIPROCAL && numbers[0] <= PROBE_SWEEP_SQRT)
        nanoseconds += atoll(getenv("SWEEP_COST")) * *(size_t *)e;
    return ((int (*)())next("clEnqueueNDRangeKernel"))(a, b, c, d, e, f, g, h, i);
}
"""
# Functions that the edits below call, after the types that they use.
TYPES = "} Pair;"
HELPERS = """
static inline real shim_flush(real a)
{
    return fabs(a) < (real)(IS_DOUBLE ? DBL_MIN : FLT_MIN) ? (real)(0) : a;
}
static inline mask shim_is_ordinary(real a)
{
    return (fabs(a) > (real)(0x1p-60f)) & (fabs(a) < (real)(0x1p60f));
}
static inline real shim_ulps_above(real a, int ulps)
{
    return lanes_select(shim_is_ordinary(a), real_from_bits(bits_from_real(a) + (integer)(ulps)), a);
}
static inline real shim_scaled(real a)
{
    return lanes_select(shim_is_ordinary(a), a * (real)(1.02f), a);
}
static inline real shim_truncate(real high, real low)
{
    return low != (real)(0) && (low < (real)(0)) == (high > (real)(0)) && fabs(high) < (real)(LARGEST)
               ? real_from_bits(bits_from_real(high) - (integer)(1)) : high;
}
"""
MODES = ["single", "strict", "double"]
ALL = ["strict", "double", "certified"]

# What is violated: (name of the property, finding, pattern of its value, edits, refused precisions).
VIOLATIONS = {
    "contraction": ("contraction", "broken", "contracted", {
        "outcome_of(a * b + c, -c - a * b)": "outcome_of(fma(a, b, c), -c - a * b)"}, ALL),
    "contraction of a difference": ("contraction", "broken", "contracted", {
        "outcome_of(a * b + c, -c - a * b)": "outcome_of(a * b + c, -fma(a, b, c))"}, ALL),
    "two-sum": ("two-sum", "broken", "loses", {"(a - (sum - of_b)) + (b - of_b)": "(real)(0)"}, ALL),
    "two-product": ("two-product", "broken", "loses", {
        "(Pair){product, real_fma(a, b, -product)}": "(Pair){product, (real)(0)}"}, ALL),
    "fma that rounds twice": ("fma", "unusual|broken", "rounds twice", {
        "#define real_fma fma": "#define real_fma(a, b, c) ((a) * (b) + (c))"}, ["double", "certified"]),
    "rounding": ("rounding", "broken", "toward zero", {
        "outcome_of(a + b, a * b)":
            "outcome_of(shim_truncate(a + b, two_sum(a, b).low), shim_truncate(a * b, fma(a, b, -(a * b))))"}, ALL),
    "division, by an ulp": ("division", "sound|unusual", "off by up to 1.* ulp", {
        "real quotient = a / b;": "real quotient = shim_ulps_above(a / b, 1);"}, []),
    "division, by three ulp": ("division", "unusual|broken", "off by up to 3.* ulp", {
        "real quotient = a / b;": "real quotient = shim_ulps_above(a / b, 3);"}, ["double", "certified"]),
    "division, of some mantissas": ("division", "sound|unusual", "off by up to 1.* ulp", {
        "real quotient = a / b;":
            "real quotient = a / b; if (!PERTURB) return lanes_select("
            "(bits_from_real(b) & (integer)(4095)) == (integer)(5), shim_ulps_above(quotient, 1), quotient);"}, []),
    "division, beyond repair": ("division", "broken", "off by", {
        "real quotient = a / b;": "real quotient = shim_scaled(a / b);"}, ALL),
    "square root, by an ulp": ("square root", "sound|unusual", "off by up to 1.* ulp", {
        "real root = sqrt(a);": "real root = shim_ulps_above(sqrt(a), 1);"}, []),
    "square root, by four ulp": ("square root", "unusual|broken", "off by up to 4.* ulp", {
        "real root = sqrt(a);": "real root = shim_ulps_above(sqrt(a), 4);"},
        ["double", "certified"]),
    "subnormals flushed": ("subnormals", "unusual", "flushed to zero", {
        "real a = real_from_bits(a_bits), b = real_from_bits(b_bits), c = real_from_bits(c_bits);":
            "real a = shim_flush(real_from_bits(a_bits)), b = shim_flush(real_from_bits(b_bits)), "
            "c = shim_flush(real_from_bits(c_bits));",
        "return (Outcome){bits_from_real(first), bits_from_real(second)};":
            "return (Outcome){bits_from_real(shim_flush(first)), bits_from_real(shim_flush(second))};"}, []),
    "subnormals mixed": ("subnormals", "unusual", "by some operations", {
        "return outcome_of(a + b, a * b);": "return outcome_of(a + b, shim_flush(a * b));"}, []),
    "infinity": ("inf and NaN", "broken", "not as", {
        "return outcome_of(a + b, a * b);": "return outcome_of(clamp(a + b, (real)(-LARGEST), (real)(LARGEST)), a * b);"},
        ALL),
    "NaN": ("inf and NaN", "broken", "not as", {
        "compared(a != b, COMPARED_UNEQUAL)": "compared((a < b) | (a > b), COMPARED_UNEQUAL)"}, ALL),
    "integer to real": ("conversions", "broken", "wrong", {
        "bits_from_real(real_from_integer(a_bits))": "bits_from_real(real_from_integer(a_bits & ~(integer)(1)))"}, ALL),
    "real to integer": ("conversions", "broken", "wrong", {
        "integer_from_real(b)}": "integer_from_real(floor(b))}"}, ALL),
    "double to float": ("conversions", "broken", "wrong", {
        "LANES_CONVERT(float)(real_from_bits(a))": "JOIN(LANES_CONVERT(float), _rtz)(real_from_bits(a))"},
        ["double", "certified"]),
}
# Violations that do not touch each other. They are probed at once, unless tests are long.
TOGETHER = (
    ("contraction", "division, by an ulp", "NaN", "integer to real"),
    ("contraction of a difference", "square root, by an ulp", "infinity", "real to integer"),
    ("two-sum", "division, by three ulp", "double to float"),
    ("two-product", "division, of some mantissas", "subnormals mixed", "square root, by four ulp"),
)
TIMERS = {"zero": "reports no times", "microseconds": "do not count nanoseconds; one unit is about 1.*e\\+03 ns|do not count nanoseconds",
          "counter": "counter", "backward": "backward"}


def merged(edits):
    return {find: replacement for edit in edits for find, replacement in edit.items()}


class PassportTest(TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        cls.shim = shim_build(f"{folder.name}/shim.so", SHIM, "-ldl", f"-I{glint.ROOT}")

    def setUp(self):
        super().setUp()
        write("sphere.yaml", SPHERE)

    def violated(self, edits=None, **variables):
        """Returns options of run: the shim, and a cache for each violation and clock, since keys have the text before it is
        edited. The driver's version distinguishes faults of timers."""
        edits = {TYPES: TYPES + HELPERS} | edits if edits else {}
        text = "\1".join(word for edit in edits.items() for word in edit)
        key = text + variables.get("FMA_COST", "")
        cache = f"{self.folder}/{hashlib.md5(key.encode()).hexdigest()}"
        if not IS_LONG:
            # sweeps end before all 8 million mantissas, as on a slow device
            variables = {"SWEEP_COST": "10000"} | variables
        if "TIMER" in variables:
            variables["DRIVER"] = variables["TIMER"]
        return {"env": {"LD_PRELOAD": self.shim, "XDG_CACHE_HOME": cache, "EDITS": text} | variables}

    def device(self, command="devices --probe --json", **options):
        """Returns the default device, probed."""
        return next(device for device in self.json(command, **options)["devices"] if device["default"])

    def findings(self, device, name):
        """Returns what each precision's passport has for a property."""
        return {passport["precision"]: next(found for found in passport["properties"] if found["name"] == name)
                for passport in device["passports"]}

    def abnormal(self, device):
        return {(passport["precision"], found["name"]): found["value"] for passport in device["passports"]
                for found in passport["properties"] if found["finding"] != "sound"}

    def test_each_violation_is_named(self):
        """Each violation is named. Without one none is, because PoCL on x86-64 conforms to IEEE 754."""
        device = self.device(**self.violated(FMA_COST="1", SWEEP_COST="0"))
        self.assertEqual([passport["precision"] for passport in device["passports"]], MODES if HAS_DOUBLE else MODES[:2])
        usual = self.abnormal(device)
        if "PoCL" in device["platform_version"]:
            self.assertEqual((usual, device["refused"]), ({}, []))
            for passport in device["passports"]:
                self.assertTrue(passport["uses_fma"])
                self.assertEqual(passport["division"]["wrong"], 0)
                self.assertGreater(passport["division"]["count"], 1000 if passport["precision"] == "double" else 1 << 23)
        together = () if IS_LONG else TOGETHER
        alone = [(what,) for what in VIOLATIONS if not any(what in group for group in together)]
        for group in [*together, *alone]:
            with self.subTest(group):
                violations = [VIOLATIONS[what] for what in group]
                device = self.device(**self.violated(merged(edits for *_, edits, _ in violations), FMA_COST="1"))
                for what, (name, finding, value, _, _) in zip(group, violations):
                    found = self.findings(device, name)
                    named = [mode for mode in found if re.search(value, found[mode]["value"])]
                    expected = [mode for mode in found if what != "double to float" or mode == "double"]
                    self.assertEqual(named, expected, (what, found))
                    for mode in named:
                        self.assertRegex(found[mode]["finding"], f"^({finding})$", (what, found[mode]))
                # properties that are computed from it may also break
                allowed = {"fma that rounds twice": {"two-product"}, "rounding": {"inf and NaN"},
                           "subnormals flushed": {"conversions"}}.get(group[0], set())
                names = {name for mode, name in self.abnormal(device).keys() - usual.keys()}
                self.assertLessEqual(names, allowed | {name for name, *_ in violations})
                if HAS_DOUBLE:
                    refused = set().union(*(refused for *_, refused in violations))
                    self.assertEqual({refusal["precision"] for refusal in device["refused"]}, refused)

    def test_refusals(self):
        """The text of devices and the commands that render report a refusal with the device, the property and what works. `single`
        does not need the property."""
        broken = self.violated(VIOLATIONS["two-sum"][3])
        process = self.glint("devices --probe", **broken)
        self.assertRegex(process.stdout, "(?m)^  two-sum +BROKEN: loses the rounding error of a sum$")
        self.assertIn("precision strict is refused: two-sum: loses", process.stdout)
        self.assertIn("BROKEN: loses", self.glint("devices", **broken).stdout, "it was not kept")
        for precision in ALL if HAS_DOUBLE else ["strict"]:
            self.refuses(f"render sphere.yaml --size 16x16 -o a.png --precision {precision}",
                         f"the device \".+\" lacks arithmetic that precision {precision} relies on: two-sum: loses the rounding error "
                         "of a sum .*; precision single renders, but its errors may be larger than documented", **broken)
        self.refuses("verify S5 --precision strict", "precision strict relies on: two-sum", **broken)
        process = self.glint("render sphere.yaml --size 16x16 -o a.png --precision single --timing", **broken)
        self.assertRegex(process.stderr, r"single, \d+ lanes?: two-sum: loses")
        report = self.json("render sphere.yaml --size 16x16 -o a.png --quiet --timing=json", **broken)
        passport, = report["by_device"][0]["passports"]
        self.assertIn({"name": "two-sum", "finding": "broken", "value": "loses the rounding error of a sum"},
                      passport["properties"])

    def test_bits_at_strict(self):
        """Deviations that glint corrects change no bit. Inexact divisions are repaired, and fma is emulated."""
        command = f"render sphere.yaml --size 32x24 --lanes {4 if IS_LONG else 1} --quiet --precision strict -o"
        self.glint(f"{command} right.npy", **self.violated())
        inexact = "division, by three ulp", "square root, by four ulp", "fma that rounds twice"
        for group in inexact, ("division, of some mantissas",):
            with self.subTest(group):
                self.glint(f"{command} other.npy", **self.violated(merged(VIOLATIONS[what][3] for what in group)))
                self.assertSameBytes("right.npy", "other.npy")

    def test_slow_fma(self):
        """An fma that is emulated at many times its cost is not used, whatever the driver claims. One not claimed must be fast."""
        for cost in "7", "9":
            with self.subTest(cost):
                device = self.device(**self.violated(FMA_COST=cost))
                for passport in device["passports"]:
                    self.assertAlmostEqual(passport["fma_cost"], int(cost), delta=0.01)
                    self.assertEqual(passport["uses_fma"], cost == "7" or passport["precision"] == "double")
                self.assertEqual(self.findings(device, "fma")["strict"]["finding"], "sound" if cost == "7" else "unusual")
                self.assertEqual(device["refused"], [])
        for cost in "1", "3":
            with self.subTest(cost, claimed=False):
                device = self.device(**self.violated(FMA_COST=cost, WITHOUT_FMA="1", DRIVER="7.7"))
                for passport in device["passports"]:
                    self.assertEqual(passport["uses_fma"], cost == "1" or passport["precision"] == "double")
                self.assertEqual("but not claimed in hardware" in self.findings(device, "fma")["strict"]["value"], cost == "3")

    def test_timers(self):
        """Each fault is named, refuses nothing, and makes reports use the host's clock."""
        for timer, pattern in TIMERS.items():
            with self.subTest(timer):
                options = self.violated(TIMER=timer)
                report = self.json("render sphere.yaml --size 64x64 --quiet --timing=json -o a.png", **options)
                device = self.device("devices --json", **options)
                found = self.findings(device, "event timers")["single"]
                self.assertEqual(found["finding"], "unusual")
                self.assertRegex(found["value"], pattern)
                self.assertEqual(device["refused"], [])
                for launch in report["by_device"][0]["launches"]:
                    self.assertIsNone(launch["event_ms"])
                    self.assertRegex(launch["fault"], pattern.split(" but")[0])

    def test_the_cache(self):
        """Each device and driver is measured once, unless a new measurement is requested."""
        def probes(command, **variables):
            write("launches", "")
            variables |= {"LAUNCHES": os.path.abspath("launches"), "XDG_CACHE_HOME": os.path.abspath("cache")}
            self.glint(command, **self.violated(**variables))
            return glint.read("launches").count("passport\n")

        render = "render sphere.yaml --size 16x16 --quiet --lanes 1 -o a.png"
        self.assertGreater(probes(render), 5)
        self.assertEqual(probes(render), 0)
        self.assertEqual(probes("devices"), 0)
        self.assertEqual(probes(f"{render} --work-group 2x2"), 0)
        self.assertGreater(probes(f"{render} --precision strict"), 5, "another precision has other options")
        self.assertEqual(probes(f"{render} --precision strict"), 0)
        self.assertGreater(probes(render, DRIVER="7.7"), 5, "another driver")
        self.assertEqual(probes(render, DRIVER="7.7"), 0)
        self.assertEqual(probes(render), 0)
        self.assertGreater(probes("devices --probe"), 5)
        self.assertGreater(probes(f"{render} --no-cache"), 5)


if __name__ == "__main__":
    if glint.IS_SANITIZED:
        skip_all("sanitizers must be loaded before a shim")
    HAS_DOUBLE = need_device()["fp64"]
    if sys.maxsize < 1 << 32 and refused_precisions():
        skip_all("violations would not show: on 32-bit x86 PoCL's arithmetic is that of x87 registers, and violates most by itself")
    main()
