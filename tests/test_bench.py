#!/usr/bin/env -S python3 -B
"""Tests glint bench on two tiny images: the figures of its JSON, its counts, and the comparison with an earlier report. The
times themselves are not checked.

run_tests: sanitize-long-only"""
import json
import math
import os
import re
import shutil
import statistics
import unittest

from glint import IS_SANITIZED, POCL, PROGRAM, ROOT, SPHERE, TestCase, faults, main, need_device, read, run, shim_build, write

QUICK = "--size 32x24 --seconds 0.1"
TINY = "--size 32x24 --no-build-times"
# NVIDIA's library, with one board, whose counter grows alike.
NVML = """
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
static unsigned long long millijoules;
int nvmlInit_v2(void) { return 0; }
int nvmlShutdown(void) { return 0; }
int nvmlDeviceGetHandleByPciBusId_v2(const char *pci, void **board)
{
    *board = &millijoules;
    return strcmp(pci, "0000:65:05.1") != 0;
}
int nvmlDeviceGetTotalEnergyConsumption(void *board, unsigned long long *total)
{
    if (getenv("SLOW")) usleep(50000);
    *total = *(unsigned long long *)board += 1000;
    if (getenv("SET_BACK") && *total == 5000) *total = 0;
    return 0;
}
"""


class Bench(TestCase):
    files = {"sphere.yaml": SPHERE}

    def assertFigure(self, value):
        """Checks that a figure is a number above 0, or states why there is none."""
        if isinstance(value, dict):
            self.assertTrue(value["status"] == "unavailable" and value["reason"], value)
        else:
            self.assertGreater(value, 0)

    def check_run(self, run):
        for times in run["frame_ms"], run["kernel_ms"]:
            self.assertTrue(0 < times["min"] <= times["median"] <= times["max"] and times["runs"] >= 1, times)
        self.assertEqual(run["frame_ms"]["runs"], run["kernel_ms"]["runs"])
        for times, samples in (run["frame_ms"], run["frame_samples_ms"]), (run["kernel_ms"], run["kernel_samples_ms"]):
            self.assertEqual((len(samples), min(samples), max(samples)), (times["runs"], times["min"], times["max"]))
        self.assertTrue(run["clock"] == "event" or (run["clock"] == "host" and run["clock_fault"]), run)
        self.assertRegex(run["kernel_hash"], "^[0-9a-f]{16}$")
        for figure in run["build_ms"].values():
            self.assertFigure(figure)
        self.assertEqual(set(run["build_ms"]), {"cold", "cached"})
        rays = run["rays"]
        self.assertEqual(set(rays), {"camera", "camera_hits", "reflected", "refracted", "shadow"})
        self.assertEqual(rays["camera"], 32 * 24)
        self.assertTrue(0 < rays["camera_hits"] <= rays["camera"] and rays["shadow"] > 0, rays)
        total = sum(rays.values()) - rays["camera_hits"]
        self.assertAlmostEqual(run["mrays_per_s"] * run["kernel_ms"]["median"] * 1e3 / total, 1, delta=1e-6)
        self.assertTrue(run["launches"])
        for launch in run["launches"]:
            self.assertEqual(launch["name"], "render")
            self.assertGreater(launch["host_ms"], 0)

    def test_report(self):
        write("two.yaml", SPHERE + SPHERE.splitlines()[-1].replace("[0, 0, 0]", "[1, 0.5, -1]"))
        process = self.glint(f"bench sphere.yaml two.yaml {QUICK} --precision single,double --launches --json")
        self.assertEqual(process.stderr, "")
        report = json.loads(process.stdout)
        self.assertEqual(report["schema"], 7)
        self.assertRegex(report["date"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$")
        self.assertTrue(report["host"]["name"] and report["build"]["compiler"])
        self.assertRegex(report["build"]["commit"], "^([0-9a-f]{40}(-dirty)?|unknown)$")
        device = report["device"]
        self.assertTrue(device["name"] and device["driver"] and device["type"] and device["units"] > 0, device)
        self.assertEqual([(run["scene"], run["precision"]) for run in report["runs"]], [
            (scene, precision) for scene in ("sphere.yaml", "two.yaml") for precision in ("single", "double")])
        runs = [run for run in report["runs"] if "status" not in run]
        for run in report["runs"]:
            self.assertEqual((run["bvh"], run["size"], run.get("traverses_bvh", False)), ("auto", [32, 24], False))
            self.assertIn(run["lanes"], (1, 4, 8, 16))
            if run in runs:
                self.check_run(run)
            else:
                self.assertEqual(run["precision"], "double")
                self.assertIn("64-bit", run["reason"])
        self.assertEqual(len({run["kernel_hash"] for run in runs}), len({run["precision"] for run in runs}), "both scenes have a kernel")
        for scene in "sphere.yaml", "two.yaml":
            counts = [run["rays"]["camera_hits"] for run in runs if run["scene"] == scene]
            self.assertLessEqual(max(counts) - min(counts), 2)

    def test_no_build_times(self):
        process = self.glint(f"bench sphere.yaml {TINY} --bvh on --seconds 0.1 --output report.json")
        untimed = {"status": "unavailable", "reason": "builds were not timed"}
        (row,) = json.loads(read("report.json"))["runs"]
        self.assertEqual((row["build_ms"], row["traverses_bvh"]), ({"cold": untimed, "cached": untimed}, True))
        self.assertNotIn("build", process.stdout)

    def test_report_in_new_folder(self):
        """The folder of kernels exists before the report in it is opened. A wrong command line creates neither."""
        command = f"bench sphere.yaml {TINY} --seconds 0.1 --keep-kernels kept --output kept/report"
        self.refuses(f"{command}.txt", "the file's ending gives no format")
        self.assertFalse(os.path.exists("kept"))
        self.glint(f"{command}.json")
        self.assertEqual(len(json.loads(read("kept/report.json"))["runs"]), 1)

    def decided(self, command, status=0):
        """Runs the command with as much time as it takes until the samples are enough for an interval."""
        for seconds in (0.5, 2, 8):
            process = run(f"{command} --seconds {seconds}")
            if process.returncode != 4:
                self.assertEqual(process.returncode, status, process.stderr)
                return process
        return self.glint(f"{command} --seconds 32", status)

    def test_comparison(self):
        """A busy machine may take many times as long, but not a million times. The calibration slows with it."""
        report = self.json(f"bench sphere.yaml {QUICK} --no-build-times --json")
        run, calibration = report["runs"][0], report["calibration"]
        for times in (run["frame_samples_ms"], run["processor_samples_ms"], calibration["samples_ms"],
                      calibration["processor_samples_ms"]):
            times[:] = [times[0]] * 20  # enough for an interval
        run["scene"] = "moved.yaml"
        write("report", json.dumps(report))
        times = run["frame_samples_ms"]
        run["frame_samples_ms"] = [1e-6 * time for time in times]
        write("faster", json.dumps(report))
        run["frame_samples_ms"], run["processor_samples_ms"] = times, [1e-9 * time for time in run["processor_samples_ms"]]
        write("less-work", json.dumps(report))
        calibration["rounds"] //= 2
        write("other-calibration", json.dumps(report))
        command = f"bench sphere.yaml {QUICK} --no-build-times --compare"
        self.assertRegex(self.decided(f"{command} report --tolerance 1e6").stdout, r"(?m)frame time [0-9.]+ \(.*\): same within")
        process = self.decided(f"{command} faster --json", status=3)
        comparison = json.loads(process.stdout)["runs"][0]["comparison"]
        self.assertEqual(comparison["verdict"], "slower")
        self.assertTrue(10 < comparison["low"] <= comparison["ratio"] <= comparison["high"], comparison)
        self.assertRegex(process.stderr, "1 of 1 rows are slower than faster")
        if report["device"]["type"] == "cpu":
            process = self.decided(f"{command} less-work --tolerance 1e6", status=3)
            self.assertRegex(process.stdout, r"(?m)frame time [0-9.]+ \(.*\): same within")
            self.assertRegex(process.stdout, r"(?m)processor time [0-9.]+ \(.*\): slower by")
        self.refuses(f"{command} other-calibration", "'other-calibration' was calibrated by 524288 rounds instead of 1048576")
        del report["calibration"]
        write("no-calibration", json.dumps(report))
        self.refuses(f"{command} no-calibration", "'no-calibration' was not calibrated")
        write("sphere.yaml", SPHERE + "# another file\n")
        self.glint(f"{command} report", status=1)  # without a row in common
        self.glint(f"{command} sphere.yaml", status=1)
        self.glint(f"{command} none", status=1)

    def test_against(self):
        """The other program is this one, whose worker's times are scaled. A program whose file is removed continues to be measured."""
        shutil.copy(PROGRAM, "copy")
        write("other", f"""#!/usr/bin/env python3
import pathlib, subprocess, sys
pathlib.Path("copy").unlink(missing_ok=True)
worker = subprocess.Popen([{str(PROGRAM)!r}, *sys.argv[1:]], stdout=subprocess.PIPE, text=True)
print(worker.stdout.readline(), end="", flush=True)
for line in worker.stdout:
    print(*(1e-6 * float(word) for word in line.split()), flush=True)
""")
        os.chmod("other", 0o755)
        command = "bench sphere.yaml --size 32x24 --no-build-times --samples 1,2 --against"
        report = self.json(f"{command} ./other --json", status=3, wrapper=("bash", "-c", 'exec ./copy "$@"'))
        self.assertEqual([run["samples"] for run in report["runs"]], [1, 2])
        for run in report["runs"]:
            self.assertEqual(run["comparison"]["verdict"], "slower")
            self.assertTrue(1000 < run["comparison"]["low"] <= run["comparison"]["ratio"] <= run["comparison"]["high"])
            self.assertEqual(len(run["pair_ratios"]), 10)
            self.assertGreaterEqual(len(run["frame_samples_ms"]), 50)
            self.assertEqual(len(run["frame_samples_ms"]), len(run["against_frame_samples_ms"]))
        process = self.glint(f"{command} {PROGRAM} --seconds 0.01", status=4)
        self.assertRegex(process.stdout, "(?m)^ +2 .*\n    1 pair\n.*: too noisy to decide")
        self.refuses(f"{command} ./none", "cannot run './none'")
        self.refuses(f"{command} /bin/true", "is not a glint that supports")
        self.refuses("bench - --against ./other", "it cannot be '-'")
        self.refuses(f"{command} ./other --compare report", "cannot be combined")
        self.refuses(f"{command} ./other --device none-such", "none-such")
        write("other", "#!/bin/sh\nkill -INT $PPID\necho 'glint: interrupted' >&2\nexit 130\n")
        self.assertEqual(self.glint(f"{command} ./other", status=130).stderr, "glint: interrupted\n")
        write("other", "#!/bin/sh\nfor i in /proc/[0-9]*; do\n    case $(cut -d ' ' -f 4 $i/stat 2>/dev/null) in\n"
                       "    $PPID) [ ${i#/proc/} = $$ ] || kill -KILL ${i#/proc/} ;;\n    esac\ndone\n"
                       f"exec {PROGRAM} \"$@\"\n")
        process = self.glint(f"{command} ./other", status=2)
        self.assertIn(f"'{os.path.realpath(PROGRAM)}' was ended by signal 9", process.stderr)
        write("other", f"#!/bin/sh\nexec {PROGRAM} \"$@\" --device none-such\n")
        self.refuses(f"{command} ./other", "no OpenCL device matches|none-such")

    def test_scene_hash(self):
        """The hash of a scene from a pipe is that of its bytes, which can be read only once."""
        os.symlink("/dev/stdin", "pipe.yaml")
        write("other.yaml", SPHERE + "# other\n")
        tiny = "--size 8x8 --seconds 0.01 --no-build-times --json"
        rows = self.json(f"bench sphere.yaml pipe.yaml other.yaml {tiny}", input=SPHERE)["runs"]
        self.assertEqual(rows[0]["scene_hash"], rows[1]["scene_hash"])
        self.assertNotEqual(rows[0]["scene_hash"], rows[2]["scene_hash"])
        changed = self.json(f"bench sphere.yaml --set camera.fov=61 {tiny}")["runs"]
        self.assertNotEqual(rows[0]["scene_hash"], changed[0]["scene_hash"])

    def test_variants(self):
        """Each variant has rows with its options. Those of later ones are compared with the first's, round by round."""
        variants = "", "--work-group 4x2", "--build-options '-DUNUSED=1 -DOTHER=2'", "--samples 1,2 --bounces 0"
        options = " ".join(f'--variant "{variant}"' for variant in variants)
        command = f"bench sphere.yaml --size 32x24 --seconds 0.4 --lanes 1 {options}"
        out = self.glint(f"{command} --launches --output report.json").stdout
        runs = json.loads(read("report.json"))["runs"]
        self.assertEqual([run["variant"] for run in runs], [*variants, variants[-1]])
        self.assertEqual([(run["samples"], run["bounces"], run["lanes"]) for run in runs],
                         [(1, 5, 1)] * 3 + [(1, 0, 1), (2, 0, 1)])
        self.assertEqual(["-DUNUSED=1 -DOTHER=2" in run["build_options"] for run in runs], [False, False, True, False, False])
        self.assertEqual([[4, 2] in [launch["local"] for launch in run["launches"]] for run in runs],
                         [False, True, False, False, False])
        self.assertEqual(["to_first" in run for run in runs], [False] + [True] * 4)
        self.assertEqual(len({len(run["frame_samples_ms"]) for run in runs}), 1, "the runs are interleaved")
        for run in runs:
            self.assertFigure(run["build_ms"]["cold"])
        for run in runs[1:]:
            times, first = run["frame_samples_ms"], runs[0]["frame_samples_ms"]
            ratios = [mine / other for mine, other in zip(times, first)]
            self.assertTrue(min(ratios) <= run["to_first"]["ratio"] <= max(ratios), run["to_first"])
        self.assertRegex(out, r'(?m)^ +1 +5  ""  ')
        self.assertRegex(out, r"(?m)^ +1 +5  --work-group 4x2 .*  [0-9.]+( \([0-9.]+ to [0-9.]+\))?$")
        self.assertEqual(re.findall(r"(?m)^ +rays: ([0-9]+) camera", out), ["768", "768", "1536"], "where they differ")
        command = f"bench sphere.yaml {TINY} --lanes 1 --seconds 0.1 --variant '' --variant '--bounces 0'"
        names = {entry["name"] for entry in self.json(f"{command} --format benchmark")["benchmarks"]}
        self.assertEqual(names, {f"sphere.yaml/32x24/single/1/auto/1/{end}" for end in ("5", "0/--bounces 0")})

    def ratio(self, run, other):
        """Returns the ratio of frame times that glint estimates, the median of the medians of up to 20 blocks of rounds."""
        logs = [math.log(mine / its) for mine, its in zip(run["frame_samples_ms"], other["frame_samples_ms"])]
        count = min(len(logs), 20)
        blocks = (logs[i * len(logs) // count:(i + 1) * len(logs) // count] for i in range(count))
        return math.exp(statistics.median(map(statistics.median, blocks)))

    def test_row_of_the_first_variant(self):
        """A row is compared with that of the same precision."""
        runs = self.json(f"bench sphere.yaml {TINY} --seconds 0.4 --precision single,strict --json "
                         "--variant '--samples 1' --variant '--samples 2'")["runs"]
        self.assertEqual([(run["precision"], run["samples"]) for run in runs],
                         [(precision, samples) for samples in (1, 2) for precision in ("single", "strict")])
        self.assertEqual(["to_first" in run for run in runs], [False, False, True, True])
        for first, run in zip(runs[:2], runs[2:]):
            self.assertAlmostEqual(run["to_first"]["ratio"] / self.ratio(run, first), 1, delta=1e-6)

    def test_clamped_lanes(self):
        """Lanes beyond the device's vectors that would repeat a row are not measured."""
        device = next(device for device in self.json("devices --json")["devices"] if device["default"])
        if device["type"] != "cpu" or device["native_double_width"] not in (4, 8):
            self.skipTest("the device does not have vectors of 4 or 8 doubles")
        command = "bench sphere.yaml --size 32x24 --seconds 0.1 --no-build-times --precision double --lanes 8,16"
        out = self.glint(f"{command} --variant '--samples 1' --variant '--lanes 16 --samples 2' --format json --output report.json").stdout
        runs = json.loads(read("report.json"))["runs"]
        keys = [(row["lanes"], row["variant"]) for row in runs]
        self.assertEqual(len(set(keys)), len(keys), keys)
        lanes = device["native_double_width"]
        self.assertEqual(runs[0]["lanes"], lanes)
        reason = f"16 lanes exceed the device's vectors, and the row of {lanes} lanes is the same"
        self.assertEqual((runs[1]["lanes"], runs[1]["status"], runs[1]["reason"]), (16, "unavailable", reason))
        self.assertEqual(runs[2]["lanes"], lanes)
        self.assertEqual(runs[2]["to_first"], {"status": "unavailable", "reason": "the first variant's row is not available"})
        self.assertIn(f"  unavailable: {reason}\n", out)
        self.assertIn("    not compared, because the first variant's row is not available\n", out)
        process = self.glint(f"{command} --against {PROGRAM}", 4)
        self.assertRegex(process.stdout, f"(?m)^ +16  unavailable: {reason}\n")

    def test_passports_of_variants(self):
        """Rows with work-groups have the device's passports, and those with build options have separate ones."""
        command = f"bench sphere.yaml {TINY} --seconds 0.1 --lanes 1 --json"
        report = self.json(f"{command} --variant '--work-group 4x2' --variant '--work-group 2x2'")
        self.assertTrue(report["device"]["passports"])
        self.assertEqual(["passports" in run for run in report["runs"]], [False, False])
        report = self.json(f"{command} --variant \"--build-options '-DUNUSED=1 -DOTHER=2'\"")  # the programs of test_variants
        self.assertFalse(report["device"]["passports"])
        self.assertEqual([passport["precision"] for passport in report["runs"][0]["passports"]], ["single"])

    def check_energy(self, source, high, env):
        """Checks energies by a counter that grows by a joule at each reading, which follows each frame unless readings take long. A
        frame takes at most `high` millijoules."""
        (row,) = self.json(f"bench sphere.yaml {TINY} --seconds 0.01 --json", env=env)["runs"]
        self.assertEqual(row["energy"]["source"], source)
        self.assertTrue(0 < row["energy"]["frame_mj"] < high, row["energy"])
        self.assertGreater(row["energy"]["watts"], 1e-3)

    @unittest.skipIf(IS_SANITIZED, "sanitizers must be loaded before a shim")
    def test_energy(self):
        self.check_energy("RAPL", 1001, {"LD_PRELOAD": shim_build("rapl.so", read(ROOT / "tests/shims/rapl.c"))})
        os.mkdir("nvml")
        shim_build("nvml/libnvidia-ml.so.1", NVML)
        limits = shim_build("limits.so", read(ROOT / "tests/shims/limits.c"), "-ldl", "-pthread")
        board = POCL | {"LD_PRELOAD": limits, "GLINT_LIMITS": "nv"}
        nvml = board | {"LD_LIBRARY_PATH": os.path.abspath("nvml")}
        self.check_energy("NVML", 1001, nvml)
        # readings of 50 ms: a second of frames between two, at least three of them
        self.check_energy("NVML", 334, nvml | {"SLOW": "1"})
        set_back = nvml | {"SET_BACK": "1"}
        (row,) = self.json(f"bench sphere.yaml {TINY} --seconds 0.01 --json", env=set_back)["runs"]
        self.assertEqual(row["energy"]["reason"], "the energy counter did not change or could not be read")
        (row,) = self.json(f"bench sphere.yaml {TINY} --seconds 0.01 --json", env=board)["runs"]
        self.assertEqual(row["energy"], {"status": "unavailable", "reason": "NVML, which measures NVIDIA boards, is not available"})

    def test_failing_variant(self):
        """The call of a variant with options for the driver is named, as it is opened and in its many runs."""
        for count in 0, 60:
            process = self.glint(f"bench sphere.yaml {TINY} --seconds 60 --variant '--work-group 4x2'", 2, env=faults(f"clEnqueueNDRangeKernel@{count}- fail"))
            self.assertRegex(process.stderr, "clEnqueueNDRangeKernel: CL_OUT_OF_RESOURCES")
            self.assertEqual(process.stdout, "")

    def test_variants_against_an_earlier_report(self):
        """Variants with different driver options have separate rows."""
        command = f"bench sphere.yaml {TINY} --seconds 0.1 --tolerance 1e6 --json"
        write("report", self.glint(f"{command} --variant '--work-group 4x2'").stdout)
        process = self.glint(f"{command} --compare report --variant '--work-group 2x2'", status=1)
        self.assertIn("report has no row of these scenes and options", process.stderr)

    def test_refused(self):
        for arguments, word in (
            ("", "scene"),
            ("none.yaml", "none.yaml"),
            ("sphere.yaml --precision half", "--precision"),
            ("sphere.yaml --lanes 2", "--lanes"),
            ("sphere.yaml --seconds 0", "--seconds"),
            ("sphere.yaml --tolerance -1", "--tolerance"),
            ("sphere.yaml --tolerance 0.9", "--tolerance"),
            ("sphere.yaml --samples 0", "--samples"),
            ("sphere.yaml --variant '--lanes 1' --variant '--lanes 2'", 'the error is in --variant "--lanes 2"'),
            ("sphere.yaml --variant '--device 0'", "glint bench --variant: unrecognized option '--device'"),
            ("sphere.yaml --variant 'sphere.yaml'", '--variant: expected options, not "sphere.yaml"'),
            ("sphere.yaml --variant '~'", '--variant: expected options, not "~"'),
            ("sphere.yaml --variant '--lanes 1' --variant '--lanes 1'", '--variant "--lanes 1" is given twice'),
            ("sphere.yaml --variant '--lanes \"1'", "--variant: a quote is not closed"),
            ("sphere.yaml --variant '--work-group 60000x2'", "--work-group: 60000x2 has 120000 work-items"),
        ):
            with self.subTest(arguments):
                self.refuses(f"bench {arguments}", word)


if __name__ == "__main__":
    need_device()
    main()
