#!/usr/bin/env -S python3 -B
"""glint bench on two tiny images: the figures of its JSON, its counts, the comparison with an earlier report. Nothing is
asked of the times themselves.

run_tests: sanitize-long-only"""
import copy
import json

from glint import ROOT, SPHERE, TestCase, main, need_device, write

QUICK = "--size 32x24 --seconds 0.1"
TRIANGLES = f"{ROOT}/scenes/triangles.yaml"


class Bench(TestCase):
    def setUp(self):
        super().setUp()
        write("sphere.yaml", SPHERE)

    def assertFigure(self, value):
        """A number above 0, or why there is none."""
        if isinstance(value, dict):
            self.assertTrue(value["status"] == "unavailable" and value["reason"], value)
        else:
            self.assertGreater(value, 0)

    def check_run(self, run):
        for times in run["frame_ms"], run["kernel_ms"]:
            self.assertTrue(0 < times["min"] <= times["median"] <= times["max"] and times["runs"] >= 1, times)
        self.assertEqual(run["frame_ms"]["runs"], run["kernel_ms"]["runs"])
        self.assertTrue(run["clock"] == "event" or (run["clock"] == "host" and run["clock_doubt"]), run)
        self.assertRegex(run["kernel_hash"], "^[0-9a-f]{16}$")
        for figure in *run["build_ms"].values(), run["peak_fraction"], run["bandwidth_fraction"]:
            self.assertFigure(figure)
        self.assertEqual(set(run["build_ms"]), {"cold", "cached"})
        self.assertEqual(isinstance(run["peak_fraction"], dict), run["traverses_bvh"])
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
        process = self.glint(f"bench sphere.yaml {TRIANGLES} {QUICK} --precision single,double --launches --json")
        self.assertEqual(process.stderr, "")
        report = json.loads(process.stdout)
        self.assertEqual(report["schema"], 3)
        device = report["device"]
        self.assertTrue(device["name"] and device["driver"] and device["type"] and device["units"] > 0, device)
        for key in "gflops_float", "gflops_double", "gigabytes_per_s":
            self.assertFigure(device["peak"][key])
        self.assertEqual([(run["scene"], run["precision"]) for run in report["runs"]], [
            (scene, precision) for scene in ("sphere.yaml", TRIANGLES) for precision in ("single", "double")])
        runs = [run for run in report["runs"] if "status" not in run]
        for run in report["runs"]:
            self.assertEqual((run["bvh"], run["size"]), ("auto", [32, 24]))
            self.assertIn(run["lanes"], (1, 4, 8, 16))
            if run in runs:
                self.check_run(run)
            else:
                self.assertEqual(run["precision"], "double")
                self.assertIn("64-bit", run["reason"])
        self.assertEqual([run["traverses_bvh"] for run in runs if run["precision"] == "single"], [False, True])
        self.assertEqual(len({run["kernel_hash"] for run in runs}), len(runs), "each kernel has a hash of its own")
        for scene in "sphere.yaml", TRIANGLES:
            counts = [run["rays"]["camera_hits"] for run in runs if run["scene"] == scene]
            self.assertLessEqual(max(counts) - min(counts), 2)

    def test_comparison(self):
        report = self.json(f"bench sphere.yaml {QUICK} --json")
        # A busy machine may take many times as long, but not a million times.
        faster = copy.deepcopy(report)
        for times in "frame_ms", "kernel_ms":
            for key in "min", "median", "max":
                faster["runs"][0][times][key] *= 1e-6
        write("report", json.dumps(report))
        write("faster", json.dumps(faster))
        command = f"bench sphere.yaml {QUICK} --compare"
        self.assertRegex(self.glint(f"{command} report --tolerance 1000000").stdout, r"(?m)baseline.* [0-9.]+.* [0-9.]+$")
        ratio = self.json(f"{command} faster --tolerance 10 --json", status=3)["runs"][0]["ratio"]
        self.assertIs(ratio["slower"], True)
        self.assertGreater(min(ratio["frame"], ratio["kernel"]), 10)
        self.glint(f"{command} report --size 16x16", status=1)  # without a row in common
        self.glint(f"{command} sphere.yaml", status=1)
        self.glint(f"{command} none", status=1)

    def test_refused(self):
        for arguments, word in (
            ("", "scene"),
            ("none.yaml", "none.yaml"),
            ("sphere.yaml --precision half", "--precision"),
            ("sphere.yaml --lanes 2", "--lanes"),
            ("sphere.yaml --seconds 0", "--seconds"),
            ("sphere.yaml --tolerance -1", "--tolerance"),
        ):
            with self.subTest(arguments):
                self.refuses(f"bench {arguments}", word)


if __name__ == "__main__":
    need_device()
    main()
