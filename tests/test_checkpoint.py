#!/usr/bin/env -S python3 -B
"""Checks that a render that ends early can be resumed, and that its image equals that of an undisturbed one. Renders end by
kill -9, a full disk, an interrupt and a device's failure, on one device and on two. GLINT_LONG_TESTS=1 kills 200 times."""
import json
import os
import random
import resource
import subprocess
import time
from pathlib import Path

from glint import IS_LONG, POCL, PROGRAM, SPHERE, TWO, TestCase, checkpoint_rows, faults, file_size, main, need_pocl, png_read, write

# one compute unit, so that bands are short
POCL, TWO = (env | {"POCL_MAX_PTHREAD_COUNT": "1"} for env in (POCL, TWO))
ROWS = 256
RENDER = f"render sphere.yaml --size 64x{ROWS} --samples 100 --precision strict --quiet"
ROW_BYTES = 64 * 3 * 4
BYTES_MAX = 120 << 10  # a file of at most that has no whole checkpoint, but the first band
KILLS = 200 if IS_LONG else 6
FAILING = faults("clEnqueueNDRangeKernel file=saved:4097 fail")  # launches fail once a band is saved


def limit_files():
    resource.setrlimit(resource.RLIMIT_FSIZE, (BYTES_MAX, BYTES_MAX))


class Checkpoints(TestCase):
    def setUp(self):
        super().setUp()
        write("sphere.yaml", SPHERE)
        self.glint(f"{RENDER} -o whole.npy", env=POCL)  # and the kernel is in the cache

    def end_early(self, options="", env=None):
        """Renders until the disk is full."""
        self.glint(f"{RENDER} {options} -o whole.npy", env=env or POCL)  # the drivers' files are written
        self.refuses(f"{RENDER} {options} -o part.png --checkpoint saved", "cannot write the checkpoint 'saved': File too large",
                     env=env or POCL, preexec_fn=limit_files)
        self.assertFalse(os.path.exists("part.png"))

    def resume(self, options="", env=None):
        """Resumes the render, and returns the share of the rows that was rendered."""
        report = self.json(f"{RENDER} {options} -o image.npy --checkpoint saved --timing=json", env=env or POCL)
        self.assertSameBytes("image.npy", "whole.npy")
        self.assertFalse(os.path.exists("saved"), "it is removed once the image is complete")
        return sum(device["share"] for device in report["by_device"])

    def share_saved(self):
        return checkpoint_rows("saved") / ROWS

    def test_undisturbed(self):
        self.assertEqual(self.resume(), 1)

    def test_full_disk(self):
        self.end_early()
        self.assertTrue(0 < self.resume() < 1)

    def test_two_devices(self):
        self.end_early("--device all", TWO)
        self.assertTrue(0 < self.resume("--device all", TWO) < 1)

    def test_counts_of_certified(self):
        """The pixels of saved bands that were re-rendered in double count as in an undisturbed render."""
        write("sphere.yaml", SPHERE + SPHERE.splitlines()[-1])  # which of two equal ones is nearer is uncertain
        command = f"{RENDER} --precision certified --timing=json"
        self.end_early("--precision certified --device all", TWO)
        whole = self.json(f"{command} -o whole.png", env=TWO)
        resumed = self.json(f"{command} -o image.npy --device all --checkpoint saved", env=TWO)
        self.assertSameBytes("image.npy", "whole.npy")
        self.assertTrue(0 < sum(device["share"] for device in resumed["by_device"]) < 1)
        self.assertGreater(whole["uncertified_samples"], 0)
        for key in "rerendered_samples", "uncertified_samples":
            self.assertEqual(resumed[key], whole[key])
        self.assertRegex(png_read("whole.png")[2]["Certified"], f"^{whole['rerendered_samples']} samples re-rendered in double, ")

    def test_failing_devices(self):
        """If no device is left, the checkpoint is kept, and the next run renders only what it lacks."""
        for devices, env in ("", POCL), ("--device all", TWO):
            process = self.glint(f"{RENDER} {devices} -o image.npy --checkpoint saved", 2, env=env | FAILING)
            self.assertRegex(process.stderr, "clEnqueueNDRangeKernel: CL_OUT_OF_RESOURCES")
            self.assertIn("run the same command again to continue", process.stderr)
            self.assertFalse(os.path.exists("image.npy"))
            saved = self.share_saved()
            self.assertTrue(0 < saved < 1)
            self.assertAlmostEqual(self.resume(devices, env), 1 - saved)
            os.remove("image.npy")

    def test_another_device(self):
        """At strict any device may resume."""
        self.end_early("--lanes 1")
        self.assertTrue(0 < self.resume("--lanes 16") < 1)

    def test_only_missing_bands_are_rendered(self):
        self.end_early()
        saved = self.share_saved()
        self.assertGreater(saved, 0)
        self.assertAlmostEqual(self.resume(), 1 - saved)

    def test_other_images(self):
        self.end_early()
        saved = Path("saved").read_bytes()
        write("other.yaml", SPHERE.replace("radius: 1", "radius: 1.01"))
        for command, reason in ((RENDER.replace("sphere", "other"), "scene"), (f"{RENDER} --set objects[0].sphere.radius=1.01", "scene"),
                                (RENDER.replace("256", "128"), "size"),
                                (RENDER.replace("strict", "single"), "precision"), (RENDER.replace("100", "99"), "samples"),
                                (f"{RENDER} --region 0,0,64,64", "region"), (f"{RENDER} --bounces 3", "bounces"), (f"{RENDER} --min-contribution 0.01", "min-contribution"),
                                (f"{RENDER} --aov t", "aov"), (f"{RENDER} --perturb 1", "perturb"),
                                (f"{RENDER} --build-options=-DUNUSED", "build-options")):
            self.refuses(f"{command} -o other.npy --checkpoint saved", rf"'saved' belongs to another image \({reason}: ", env=POCL)
        self.refuses(f"{RENDER} -o other.npy --checkpoint sphere.yaml", "'sphere.yaml' is not a checkpoint", env=POCL)
        self.assertEqual(Path("saved").read_bytes(), saved)
        self.assertEqual(Path("sphere.yaml").read_text(encoding="utf-8"), SPHERE)
        self.assertTrue(0 < self.resume() < 1)

    def test_other_devices_at_single(self):
        single = RENDER.replace("strict", "single")
        self.glint(f"{single} -o other.png", env=POCL)
        self.refuses(f"{single} -o other.png --checkpoint saved", "File too large", env=POCL, preexec_fn=limit_files)
        self.refuses(f"{single} --lanes 1 -o other.png --checkpoint saved", r"belongs to another image \(device: ", env=POCL)

    def test_the_image_itself(self):
        """A checkpoint with the name of the image is replaced by the image, not removed."""
        self.glint(f"{RENDER} -o same.npy --checkpoint same.npy", env=POCL)
        self.assertSameBytes("same.npy", "whole.npy")

    def test_frames(self):
        """Each frame has its bands in a file. Complete frames are kept, and each of the others reports in one line."""
        write("moving.yaml", SPHERE.replace("radius: 1", "radius: {keys: {0: 1, 2: 0.5}}"))
        frames = RENDER.replace("sphere.yaml", "moving.yaml")
        self.glint(f"{frames} --frames 0-2 -o whole%d.npy", env=POCL)
        command = f"{frames} --frames 0-2 --skip-existing --checkpoint saved-%02d -o image%d.npy --timing=json"
        write("image0.npy", "kept")
        process = self.refuses(command, "cannot write the checkpoint 'saved-01': File too large", env=POCL, preexec_fn=limit_files)
        self.assertIn("finished bands are in 'saved-01'", process.stderr)
        os.remove("saved-02")
        reports = [json.loads(line) for line in self.glint(command, env=POCL).stdout.splitlines()]
        self.assertEqual([(report["scene"], report["frame"]) for report in reports], [("moving.yaml", 1), ("moving.yaml", 2)])
        first, second = (report["by_device"][0]["share"] for report in reports)
        self.assertTrue(0 < first < 1)
        self.assertEqual(second, 1)
        self.assertEqual(Path("image0.npy").read_text(encoding="utf-8"), "kept")
        for frame in 1, 2:
            self.assertSameBytes(f"image{frame}.npy", f"whole{frame}.npy")
        self.assertEqual(list(Path().glob("saved*")), [])
        self.refuses(f"{frames} --frames 1 --checkpoint same --skip-existing -o same", "would keep a --checkpoint")
        self.glint(f"{frames} --frames 1 --checkpoint saved -o image1.npy", env=POCL)
        self.assertSameBytes("image1.npy", "whole1.npy")

    def test_kills(self):
        """After kill -9 at any moment, the next run resumes from whatever is left."""
        command = [PROGRAM, *f"{RENDER.replace('100', '3000')} --device all -o image.npy --checkpoint saved".split()]
        environment = {name: value for name, value in os.environ.items() if name != "GLINT_DEVICE"} | TWO
        self.glint(f"{RENDER.replace('100', '3000')} -o whole.npy", env=POCL)
        moments = random.Random(1)
        kills = renders = 0
        while kills < KILLS:
            process = subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL)
            # between what is saved and slightly more than the whole, and at any moment of a band
            least = moments.uniform(file_size("saved"), 1.1 * ROWS * ROW_BYTES)
            while process.poll() is None and file_size("saved") < least:
                time.sleep(0.001)
            time.sleep(moments.choice((0, moments.uniform(0, 0.02))))
            if process.poll() is None:
                process.kill()
                kills += 1
            status = process.wait()
            if status == 0:
                self.assertSameBytes("image.npy", "whole.npy")
                os.remove("image.npy")
                renders += 1
            else:
                self.assertEqual(status, -9)
        saved = self.share_saved()
        self.assertAlmostEqual(self.resume("--device all --samples 3000", TWO), 1 - saved)
        self.nothing_left("*.glint-*")
        print(f"{kills} kills, {renders} images complete between them")


if __name__ == "__main__":
    need_pocl()
    main()
