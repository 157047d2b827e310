#!/usr/bin/env -S python3 -B
"""Compares the figures of glint accuracy on tiny images with those computed here from the saved arrays, by docs/accuracy.md's
definitions. Also tests a reference from a file, and what is refused. Times themselves are not checked.

run_tests: sanitize-long-only"""
import json
import math
import tempfile
from collections import namedtuple
from pathlib import Path

from glint import BALLS, IS_LONG, PLANET, ROOT, TestCase, main, need_device, plain, png_read, read, run, skip_all, terminal_run, write
from metrics import flip, np, percentile_99_9, psnr, srgb8_distance, srgb_encode

MISS = 0xFFFFFFFF
SMALL = "--size 96x64 --seconds 0.2 --bounces 16"
# Rays of this scene change direction. The kernels of glass, whose figures are made in the same way, are for long tests.
BENT = f"{ROOT}/scenes/mirror-glass.yaml" if IS_LONG else BALLS
BALLS_INDEX = 3 if IS_LONG else 0  # of BALLS among the measured scenes
Approx = namedtuple("Approx", "value relative absolute", defaults=(0, 0))


def arrays_load(prefix, light_count):
    arrays = {name: np.load(f"{prefix}.{name}.npy") for name in ("color", "t", "normal", "object", "path")}
    shape = *arrays["t"].shape, light_count
    arrays["shadow"] = np.load(f"{prefix}.shadow.npy").reshape(shape) if light_count else np.zeros(shape, np.uint32)
    assert arrays["color"].dtype == arrays["normal"].dtype == arrays["t"].dtype
    arrays["bits"] = 53 if arrays["t"].dtype == np.float64 else 24
    for name in "color", "t", "normal":
        arrays[name] = arrays[name].astype(np.float64)
    return arrays


def edges_of(values):
    """Returns the pixels that differ from a 4-neighbor, and the 8 pixels around each of these."""
    differs = np.zeros(values.shape, bool)
    across, down = values[:, 1:] != values[:, :-1], values[1:] != values[:-1]
    differs[:, 1:] |= across
    differs[:, :-1] |= across
    differs[1:] |= down
    differs[:-1] |= down
    height, width = values.shape
    padded = np.pad(differs, 1)
    return np.logical_or.reduce([padded[dy : dy + height, dx : dx + width] for dy in range(3) for dx in range(3)])


def wrong_pixels(reference, variant):
    """Returns the pixels of another object, and, where the object is the same, of another shadow and of another path."""
    same = variant["object"] == reference["object"]
    return {"object": ~same, "shadow": (variant["shadow"] != reference["shadow"]) & same[:, :, None],
            "path": (variant["path"] != reference["path"]) & same}


def color_error(reference, variant):
    with np.errstate(invalid="ignore"):
        error = np.abs(variant["color"] - reference["color"])
    finite = [np.isfinite(arrays["color"]) for arrays in (reference, variant)]
    return np.where(finite[0] & finite[1], error, np.where(finite[0] | finite[1], np.inf, 0)).max(axis=2)


def worst_candidates(wrong, edges):
    """Returns the wrong pixels away from edges if there are any, else those at edges."""
    away = wrong & ~edges
    candidates = away if away.any() else wrong
    return candidates.any(axis=2) if candidates.ndim == 3 else candidates


def max_and_p99_9(values, relative=1e-12):
    return {"max": Approx(float(values.max()), relative), "p99_9": Approx(percentile_99_9(values), 1e-6)}


def shading_errors(difference):
    values = difference[np.isfinite(difference)]
    magnitude = float(np.mean(np.abs(values)))
    return {"pixels": difference.shape[0], "rmse": Approx(math.sqrt(np.mean(values**2)), 1e-9),
            "bias": Approx(float(np.mean(values)), absolute=1e-9 * magnitude)} | max_and_p99_9(np.abs(values))


def image_errors(reference, variant):
    finite = np.isfinite(reference) & np.isfinite(variant)
    squares = (variant - reference)[finite] ** 2
    distance = srgb8_distance(*(srgb_encode(a.astype(np.float32).astype(np.float64)) for a in (reference, variant)))
    flip_map, flip_mean = flip(srgb_encode(reference), srgb_encode(variant))
    return {"rmse": Approx(math.sqrt(np.mean(squares)), 1e-9), "psnr": Approx(psnr(np.mean(squares)), 1e-9),
            "rel_mse": Approx(float(np.mean(squares / (reference[finite] ** 2 + 0.01))), 1e-9),
            "off_by_1": int((distance == 1).sum()), "off_by_more": int((distance > 1).sum()),
            "srgb_psnr": Approx(psnr(np.mean(distance**2) / 255**2), 1e-9),
            "flip_mean": Approx(float(flip_mean), absolute=2e-5), "flip_max": Approx(float(flip_map.max()), absolute=2e-4)}


def normal_angles(a, b):
    """Returns Kahan's angle between unit vectors, not the cross product's. Its errors are of the last place of 1."""
    a, b = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (a, b))
    return 2 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))


def expected_variant(reference, variant, edges):
    """Returns the members of a measured variant that follow from its arrays and the reference's."""
    color, wrong = variant["color"], wrong_pixels(reference, variant)
    errors = {kind: {"edge": int((wrong[kind] & edges[kind]).sum()), "away": int((wrong[kind] & ~edges[kind]).sum())}
              for kind in wrong}
    errors["nonfinite"] = int((~np.isfinite(color)).any(axis=2).sum())
    errors["negative"] = int((color < 0).any(axis=2).sum())
    surface = ~wrong["object"] & (reference["object"] != MISS)
    errors["shading"] = shading_errors((color - reference["color"])[surface & ~wrong["shadow"].any(axis=2) & ~wrong["path"]])
    t, expected_t = variant["t"][surface], reference["t"][surface]
    ulp = 2.0 ** (np.floor(np.log2(expected_t)) + 1 - variant["bits"])
    errors["t"] = {"pixels": int(surface.sum()), "relative": max_and_p99_9(np.abs(t - expected_t) / expected_t),
                   "ulps": max_and_p99_9(np.abs(t - expected_t) / ulp)}
    angle = normal_angles(variant["normal"][surface], reference["normal"][surface])
    errors["normal"] = {"max": Approx(float(angle.max()), 1e-6, 1e-15), "p99_9": Approx(percentile_99_9(angle), 1e-6, 1e-15)}
    errors["image"] = image_errors(reference["color"], color)
    worst = {}
    for kind in wrong:
        candidates = worst_candidates(wrong[kind], edges[kind])
        error = color_error(reference, variant)[candidates]
        worst[kind] = {"error": Approx(float(error.max()), 1e-12)} if error.size else None
    faults = errors["nonfinite"] + errors["negative"] + errors["object"]["away"] + errors["shadow"]["away"]
    return {"errors": errors, "worst": worst, "crossed_out": faults > 0}


def plotted(variant, kind):
    errors = variant["errors"]
    if kind in ("object", "shadow", "path"):
        return errors[kind]["edge"] + errors[kind]["away"]
    if kind in ("shading", "image"):
        return errors[kind]["rmse"]
    return {"t": errors["t"]["relative"]["p99_9"], "normal": errors["normal"]["p99_9"],
            "flip": errors["image"]["flip_mean"]}[kind]


def expected_fronts_and_picks(scene):
    """Returns the variants on the Pareto front of each type of error and time, and the fastest within each budget."""
    variants = scene["variants"]
    times = [variant["frame_ms"]["median"] if "frame_ms" in variant else math.inf for variant in variants]
    sound = [i for i, v in enumerate(variants) if v["status"] == "measured" and not v["crossed_out"]]
    references = [i for i, v in enumerate(variants) if v["status"] == "reference"]

    def on_front(i, kind):
        mine = plotted(variants[i], kind), times[i]
        others = [(plotted(variants[k], kind), times[k]) for k in sound if k != i]
        dominated = any(error <= mine[0] and time <= mine[1] and (error, time) != mine for error, time in others)
        return i in sound and not dominated and not any(times[k] < times[i] for k in references)

    def pick(budget, measure):
        within = references + [i for i in sound if plotted(variants[i], measure) <= budget]
        return min(within, key=lambda i: times[i], default=None)

    return {"variants": [{"pareto": {kind: on_front(i, kind) for kind in variant["pareto"]}} if "pareto" in variant else {}
                         for i, variant in enumerate(variants)],
            "picks": [{"variant": pick(each["budget"], each["measure"])} for each in scene["picks"]]}


class Accuracy(TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.saved = f"{folder.name}/saved"
        cls.spheres, far = (plain(scene, folder.name) for scene in ("spheres16.yaml", "far.yaml"))
        scenes = [BENT, cls.spheres, far] + [BALLS] * IS_LONG
        cls.process = run(f"accuracy {' '.join(map(str, scenes))} {SMALL} --precision single,double --json --save {cls.saved}")
        cls.report = json.loads(cls.process.stdout or "null")
        cls.reference = f"{cls.saved}/0-{Path(BENT).stem}-reference"

    def check(self, where, reported, expected):
        """Checks every member of what is expected. JSON has null for what is not finite."""
        if isinstance(expected, dict):
            for key, value in expected.items():
                self.check(f"{where}.{key}", reported[key], value)
        elif isinstance(expected, list) and expected and isinstance(expected[0], dict):
            self.assertEqual(len(reported), len(expected), where)
            for index, value in enumerate(expected):
                self.check(f"{where}[{index}]", reported[index], value)
        elif not isinstance(expected, Approx):
            self.assertEqual(reported, expected, where)
        elif not math.isfinite(expected.value):
            self.assertIsNone(reported, where)
        else:
            tolerance = expected.relative * abs(expected.value) + expected.absolute
            self.assertLessEqual(abs(reported - expected.value), tolerance, f"{where}: {reported}, not {expected.value}")

    def test_runs_silently(self):
        self.assertEqual((self.process.returncode, self.process.stderr), (0, ""))

    def test_every_figure(self):
        for scene in self.report["scenes"]:
            reference = arrays_load(scene["reference"]["saved"], scene["lights"])
            edges = {kind: edges_of(reference[kind]) for kind in ("object", "path")}
            lights = [edges_of(reference["shadow"][:, :, i]) for i in range(scene["lights"])]
            counts = {"silhouette": int(edges["object"].sum()), "path": int(edges["path"].sum()),
                      "shadow": [int(light.sum()) for light in lights]}
            edges["shadow"] = np.stack(lights, axis=2) | edges["object"][:, :, None]
            self.check(scene["scene"], scene, {"edges": counts} | expected_fronts_and_picks(scene))
            for variant in scene["variants"]:
                if variant["status"] == "measured":
                    self.check_variant(f"{scene['scene']} at {variant['precision']}", variant, reference,
                                       arrays_load(variant["saved"], scene["lights"]), edges)

    def check_variant(self, where, reported, reference, variant, edges):
        self.check(where, reported, expected_variant(reference, variant, edges))
        self.assertEqual(bool(reported["why"]), reported["crossed_out"], where)
        for kind, wrong in wrong_pixels(reference, variant).items():
            worst = reported["worst"][kind]
            if worst:
                place = worst["y"], worst["x"]
                self.assertTrue(worst_candidates(wrong, edges[kind])[place], f"{where}, {kind}")
                error = float(color_error(reference, variant)[place])
                self.check(where, worst["error"], Approx(error, 1e-12))

    def test_errors_of_each_scene(self):
        bent, spheres, far, *_ = variants = [scene["variants"] for scene in self.report["scenes"]]
        self.assertEqual([variant["status"] for variant in bent], ["measured", "reference"])
        self.assertNotIn("errors", bent[1])
        self.assertGreater(bent[1]["frame_ms"]["runs"], 0)
        edges = self.report["scenes"][0]["edges"]
        self.assertGreater(edges["path"], edges["silhouette"])
        self.assertGreater(variants[BALLS_INDEX][0]["errors"]["path"]["edge"], 0)
        for single, _ in spheres, far:
            self.assertFalse(single["crossed_out"])
            self.assertEqual((single["errors"]["object"]["away"], single["errors"]["shadow"]["away"]), (0, 0))
            self.assertLess(single["errors"]["shading"]["rmse"], 1e-6)

    def test_reference_from_a_file(self):
        """Only colors are compared, with the same result, and nothing else gets a figure."""
        options = f"{SMALL} --precision single,double --json --reference {self.reference}.color.npy"
        scene = self.json(f"accuracy {BENT} {options}")["scenes"][0]
        single, double = (variant["errors"] for variant in scene["variants"])
        for kind in "object", "shadow", "path", "shading", "t", "normal":
            self.assertEqual(single[kind]["status"], "unavailable")
        self.assertEqual(scene["edges"]["status"], "unavailable")
        self.assertEqual(single["image"], self.report["scenes"][0]["variants"][0]["errors"]["image"])
        self.assertEqual((double["image"]["rmse"], double["image"]["psnr"]), (0, None))

    def test_larger_reference(self):
        """The reference is three times as wide and high, and the means of its squares are compared."""
        small = np.load(f"{self.reference}.color.npy")
        random = np.random.default_rng(5)
        parts = random.uniform(-1, 1, (64, 3, 96, 3, 3))
        parts -= parts.mean(axis=(1, 3), keepdims=True)
        np.save("large.npy", (small[:, None, :, None] + parts).reshape(192, 288, 3))
        scene = self.json(f"accuracy {BENT} {SMALL} --precision single,double --json --reference large.npy")["scenes"][0]
        single, double = (variant["errors"]["image"] for variant in scene["variants"])
        expected = self.report["scenes"][0]["variants"][0]["errors"]["image"]
        self.assertTrue(math.isclose(single["rmse"], expected["rmse"], rel_tol=1e-9))
        self.assertLess(double["rmse"], 1e-14)

    def test_samples(self):
        """An image with fewer samples than the reference has an error."""
        scene = self.json(f"accuracy {self.spheres} {SMALL} --precision double --samples 1,8 --json")["scenes"][0]
        self.assertEqual(scene["reference"]["samples"], 8)
        for variant in scene["variants"]:
            if variant["status"] == "measured":
                self.assertEqual(variant["errors"]["image"]["rmse"] > 1e-3, variant["samples"] == 1)

    def test_table(self):
        table = self.glint(f"accuracy {self.spheres} {SMALL} --precision double").stdout
        self.assertRegex(table, r"(?m)^frame ms\n +[0-9.e-]+\n    the reference\nreference: double, .* at silhouettes$")
        self.assertRegex(table, "(?m)^  for an error of at most 1e-06: double, .* ms, the reference itself; no other is within it$")

    def test_ties(self):
        """Each pick lists the other rows within its budget. A sentence states that two runs are too few to compare times."""
        for scene in self.report["scenes"]:
            for pick in scene["picks"]:
                within = [i for i, v in enumerate(scene["variants"]) if i != pick["variant"] and
                          (v["status"] == "reference" or plotted(v, pick["measure"]) <= pick["budget"])]
                self.assertEqual([other["variant"] for other in pick["others"]], within)
                for other in pick["others"]:
                    self.assertEqual(other["ties"], other["low"] <= 1)
                    self.assertLessEqual(other["low"], other["ratio"])
        scene = self.json(f"accuracy {self.spheres} --size 480x300 --bounces 16 --seconds 0.0001 --precision single,double --json")
        (_, pick, _), (single, double) = scene["scenes"][0]["picks"], scene["scenes"][0]["variants"]
        self.assertLess(single["frame_ms"]["runs"], 8)
        self.assertEqual([(other["ties"], other["high"]) for other in pick["others"]], [(True, None)])
        self.assertRegex(pick["text"], "; too few runs to compare it with (single|double)$")
        self.assertEqual(scene["scenes"][0]["confidence"], 0.99)
        self.assertEqual(double["frame_ms"]["runs"], single["frame_ms"]["runs"])

    def test_progress(self):
        """Progress is printed only to a terminal, on standard error, with the rows and the time left."""
        errors = terminal_run(f"accuracy {self.spheres} --size 1280x800 --bounces 16 --seconds 2.6 --precision single,double --json")
        # the time left is known after two seconds, which may be at any step
        for step in "measuring rows 1 to 2 of 2", r"[a-z]+ (the reference for )?rows? [^\r]*, \d+ seconds? left", "comparing row 2 of 2":
            self.assertRegex(errors, rf"\r *\d+% \x1b\[K {step}")

    def test_budgets(self):
        """Budgets are reported in the list's order. No variant is within the smallest, and the fastest is within the largest."""
        scene = self.json(f"accuracy {self.spheres} {SMALL} --precision single,strict --budget 1e-30,1e30,0.5 --json")["scenes"][0]
        self.assertEqual([pick["budget"] for pick in scene["picks"]], [1e-30, 1e30, 0.5])
        self.assertIsNone(scene["picks"][0]["variant"])
        self.assertEqual(expected_fronts_and_picks(scene)["picks"], [{"variant": pick["variant"]} for pick in scene["picks"]])
        for wrong in ["", "0", "-1", "1e-3,", "nan", "1;2", ",".join(["1"] * 17)]:
            self.refuses(f"accuracy {self.spheres} {SMALL} --budget={wrong}", "--budget")

    def test_max_error(self):
        """The chosen precision stays within the budget, which the image and the report name."""
        for budget, only in ("0.5", None), ("0.2:flip", None), ("1e-3:max", None), ("1e-9", "double"), ("1e-5:flip", "double"):
            limit, _, metric = budget.partition(":")
            with self.subTest(budget):
                report = self.json(f"render {self.spheres} --size 96x64 --bounces 16 --aov color --max-error {budget} "
                                   "--timing=json --quiet -o chosen.png")
                pilot, chosen = report["pilot"], report["precision"]
                candidates = {candidate["precision"]: candidate for candidate in pilot["candidates"]}
                self.assertTrue(candidates[chosen]["keeps"])
                self.assertIn(only, (None, chosen))
                self.assertEqual((pilot["limit"], pilot["metric"], pilot["pixels"]), (float(limit), metric or "rmse", 32 * 21 + 96))
                texts = png_read("chosen.png")[2]
                self.assertEqual(texts["Precision"], chosen)
                self.assertEqual(texts["Budget"], f"{float(limit):g} {pilot['metric']}")
                self.assertTrue(texts["Pilot"].startswith(f"{chosen}: "))
                reference, image = np.load(f"{self.saved}/1-spheres16-reference.color.npy"), np.load("chosen.color.npy")
                error = {"rmse": np.sqrt(np.mean((image - reference) ** 2)), "max": np.abs(image - reference).max(),
                         "flip": flip(*(srgb_encode(np.clip(light, 0, 1)) for light in (reference, image)))[1]}[pilot["metric"]]
                self.assertLessEqual(error, float(limit))
                self.assertLessEqual(image.max(), pilot["color_max"])
                self.assertLess(pilot["color_max"], 3 * image.max(), "no lazy bound")

    def test_max_error_refused(self):
        for wrong in "", "0", "-1", "nan", "inf", "0.1x", "0.1:", "0.1:psnr":
            self.refuses(f"render {self.spheres} --max-error={wrong}", "--max-error")
        for other in "precision", "checkpoint":
            self.refuses(f"render {self.spheres} --max-error 0.1 --{other} strict", other)

    def test_scene_beyond_a_precision(self):
        write("planet.yaml", PLANET)
        scene = self.json(f"accuracy planet.yaml {SMALL} --precision single --perturb 1:1000 --json")["scenes"][0]
        (single,) = scene["variants"]
        self.assertTrue(single["crossed_out"])
        self.assertGreater(single["errors"]["shadow"]["away"], 0)
        self.assertFalse(any(single["pareto"].values()))
        self.assertEqual([pick["variant"] for pick in scene["picks"]], [None, None, None])

    def test_perturbation(self):
        """Injected errors change the variants' kernels but no bit of the reference."""
        self.glint(f"accuracy {BALLS} {SMALL} --precision double --perturb 1:1000 --save perturbed --output perturbed/report.json")
        report = json.loads(read("perturbed/report.json"))
        (scene,) = report["scenes"]
        (double,) = scene["variants"]
        self.assertEqual(report["perturb"], {"seed": 1, "scale": 1000})
        self.assertEqual(double["status"], "measured")
        self.assertNotEqual(double["kernel_hash"], scene["reference"]["kernel_hash"])
        self.assertSameBytes("perturbed/0-mirror-balls-reference.color.npy",
                             f"{self.saved}/{BALLS_INDEX}-mirror-balls-reference.color.npy")

    def test_refused(self):
        write("file", "")
        for arguments, pattern in (
            ("", "scene"),
            ("none.yaml", "none.yaml"),
            (f"{BENT} --samples 1,0", "--samples"),
            (f"{BENT} --reference none.npy", "none.npy"),
            (f"{BENT} --size 64x48 --reference {self.reference}.color.npy", "96x64"),
            (f"{BENT} --size 96x32 --reference {self.reference}.color.npy", "not a multiple"),
            (f"{BENT} --size 96x64 --reference {self.reference}.t.npy", r"\.t\.npy"),
            (f"{BENT} --reference {ROOT}/docs/still-life.png", r"still-life\.png"),
            (f"{BENT} {self.spheres} --reference {self.reference}.color.npy", "one scene"),
            (f"{BENT} --size 8x8 --save file/folder", "file/folder"),
        ):
            with self.subTest(arguments):
                self.refuses(f"accuracy {arguments}", pattern)


if __name__ == "__main__":
    if not need_device()["fp64"]:
        assert run(f"accuracy {BENT}").returncode == 1
        skip_all("the device has no 64-bit floating point for a reference")
    main()
