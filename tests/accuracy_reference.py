#!/usr/bin/env python3
"""Every figure of glint accuracy --json --save, from the saved arrays and docs/accuracy.md's definitions, by numpy, and
FLIP by flip-evaluator.

usage: accuracy_reference.py REPORT.json
"""
import json
import math
import sys

import flip_evaluator
import numpy as np

report = json.load(open(sys.argv[1]))
NOTHING = 0xFFFFFFFF
checked = faults = 0


def expect(where, told, expected, tolerance=0.0):
    """`tolerance` is relative; JSON has null for what is not finite."""
    global checked, faults
    checked += 1
    if isinstance(expected, float) and not math.isfinite(expected):
        expected = None
    if told == expected:
        return
    if None not in (told, expected) and not isinstance(expected, (bool, str, list, dict)):
        if abs(told - expected) <= tolerance * abs(expected):
            return
    print(f"{where}: told {told}, expected {expected}")
    faults += 1


def arrays_load(prefix, light_count):
    arrays = {name: np.load(f"{prefix}.{name}.npy") for name in ("color", "t", "normal", "object", "path")}
    height, width = arrays["t"].shape
    if light_count > 0:
        arrays["shadow"] = np.load(f"{prefix}.shadow.npy").reshape(height, width, light_count)
    else:
        arrays["shadow"] = np.zeros((height, width, 0), np.uint32)
    arrays["wide"] = arrays["t"].dtype == np.float64
    assert arrays["color"].dtype == arrays["normal"].dtype == arrays["t"].dtype
    for name in "color", "t", "normal":
        arrays[name] = arrays[name].astype(np.float64)
    return arrays


def edges_of(values):
    """Pixels that differ from a 4-neighbour, and the 8 pixels around each of these."""
    differs = np.zeros(values.shape, bool)
    across = values[:, 1:] != values[:, :-1]
    differs[:, 1:] |= across
    differs[:, :-1] |= across
    down = values[1:] != values[:-1]
    differs[1:] |= down
    differs[:-1] |= down
    height, width = values.shape
    padded = np.pad(differs, 1)
    shifted = [padded[dy : dy + height, dx : dx + width] for dy in range(3) for dx in range(3)]
    return np.logical_or.reduce(shifted)


def percentile(values):
    return float(np.quantile(values, 0.999, method="inverted_cdf"))


def check_counts(where, told, wrong, edges):
    expect(f"{where}, edge", told["edge"], int((wrong & edges).sum()))
    expect(f"{where}, away", told["away"], int((wrong & ~edges).sum()))


def color_error(reference, variant):
    with np.errstate(invalid="ignore"):
        error = np.abs(variant["color"] - reference["color"])
    finite = [np.isfinite(picture["color"]) for picture in (reference, variant)]
    error = np.where(finite[0] & finite[1], error, np.where(finite[0] | finite[1], np.inf, 0))
    return error.max(axis=2)


def check_worst(where, told, wrong, edges, error):
    """Of counted kinds: the largest difference of color, away from edges if there is any."""
    wrong, edges = (a.any(axis=2) if a.ndim == 3 else a for a in (wrong, edges))
    if not wrong.any():
        expect(where, told, None)
        return
    expect(f"{where}, error", told["error"], float(error[wrong].max()), 1e-12)
    expect(f"{where}, place", bool(wrong[told["y"], told["x"]]), True)
    expect(f"{where}, its error", float(error[told["y"], told["x"]]), told["error"], 1e-12)


def check_shading(where, told, difference):
    expect(f"{where}, pixels", told["pixels"], difference.shape[0])
    values = difference[np.isfinite(difference)]
    expect(f"{where}, max", told["max"], float(np.abs(values).max()), 1e-12)
    expect(f"{where}, RMSE", told["rmse"], math.sqrt(np.mean(values**2)), 1e-9)
    expect(f"{where}, 99.9 %", told["p99_9"], percentile(np.abs(values)), 1e-6)
    magnitude = float(np.mean(np.abs(values)))
    expect(f"{where}, bias", told["bias"] + magnitude, float(np.mean(values)) + magnitude, 1e-9)


def check_extent(where, told, values, tolerance=1e-12):
    expect(f"{where}, max", told["max"], float(values.max()), tolerance)
    expect(f"{where}, 99.9 %", told["p99_9"], percentile(values), 1e-6)


def srgb_encode(linear):
    linear = np.clip(np.nan_to_num(linear, nan=0), 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def check_image(where, told, reference, variant):
    finite = np.isfinite(reference["color"]) & np.isfinite(variant["color"])
    expected, found = reference["color"][finite], variant["color"][finite]
    squares = (found - expected) ** 2
    mean = float(np.mean(squares))
    expect(f"{where}, RMSE", told["rmse"], math.sqrt(mean), 1e-9)
    expect(f"{where}, PSNR", told["psnr"], -10 * math.log10(mean) if mean > 0 else math.inf, 1e-9)
    expect(f"{where}, relMSE", told["rel_mse"], float(np.mean(squares / (expected**2 + 0.01))), 1e-9)
    steps = [np.floor(255 * srgb_encode(a["color"].astype(np.float32).astype(np.float64)) + 0.5)
             for a in (reference, variant)]
    distance = np.abs(steps[0] - steps[1])
    expect(f"{where}, off by 1", told["off_by_1"], int((distance == 1).sum()))
    expect(f"{where}, off by more", told["off_by_more"], int((distance > 1).sum()))
    mean = float(np.mean(distance**2)) / 255**2
    expect(f"{where}, PSNR of 8 bits", told["srgb_psnr"], -10 * math.log10(mean) if mean > 0 else math.inf, 1e-9)
    # FLIP by its authors' own program, which works in float
    displayed = [srgb_encode(a["color"]).astype(np.float32) for a in (reference, variant)]
    map_, mean, _ = flip_evaluator.evaluate(*displayed, "LDR", inputsRGB=True, applyMagma=False, computeMeanError=True,
                                            parameters={"ppd": 67})
    expect(f"{where}, FLIP", 1 + told["flip_mean"], 1 + float(mean), 2e-5)
    expect(f"{where}, FLIP max", 1 + told["flip_max"], 1 + float(map_.max()), 2e-4)


def check_variant(where, scene, told, reference, edges):
    variant = arrays_load(told["saved"], scene["lights"])
    color, errors, worst = variant["color"], told["errors"], told["worst"]
    nonfinite = int((~np.isfinite(color)).any(axis=2).sum())
    negative = int((color < 0).any(axis=2).sum())
    expect(f"{where}, not finite", errors["nonfinite"], nonfinite)
    expect(f"{where}, negative", errors["negative"], negative)

    same = variant["object"] == reference["object"]
    wrong_shadow = (variant["shadow"] != reference["shadow"]) & same[:, :, None]
    wrong_path = (variant["path"] != reference["path"]) & same
    check_counts(f"{where}, object", errors["object"], ~same, edges["object"])
    check_counts(f"{where}, shadow", errors["shadow"], wrong_shadow, edges["shadow"])
    check_counts(f"{where}, path", errors["path"], wrong_path, edges["path"])
    for kind, wrong in ("object", ~same), ("shadow", wrong_shadow), ("path", wrong_path):
        away = wrong & ~edges[kind]
        check_worst(f"{where}, worst {kind}", worst[kind], away if away.any() else wrong, edges[kind],
                    color_error(reference, variant))

    surface = same & (reference["object"] != NOTHING)
    shaded = surface & ~wrong_shadow.any(axis=2) & ~wrong_path
    check_shading(f"{where}, shading", errors["shading"], (color - reference["color"])[shaded])
    t, expected_t = variant["t"][surface], reference["t"][surface]
    difference = np.abs(t - expected_t)
    bits = 53 if variant["wide"] else 24
    ulp = 2.0 ** (np.floor(np.log2(expected_t)) + 1 - bits)
    expect(f"{where}, t, pixels", errors["t"]["pixels"], int(surface.sum()))
    check_extent(f"{where}, t", errors["t"]["relative"], difference / expected_t)
    check_extent(f"{where}, t in ulps", errors["t"]["ulps"], difference / ulp)
    a, b = variant["normal"][surface], reference["normal"][surface]
    # Kahan's angle between unit vectors, in place of the cross product's
    a, b = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (a, b))
    angle = 2 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
    # that form has errors of its own, of the last place of 1
    told_normal = errors["normal"]
    expect(f"{where}, normal, max", told_normal["max"] + 1e-9, float(angle.max()) + 1e-9, 1e-6)
    expect(f"{where}, normal, 99.9 %", told_normal["p99_9"] + 1e-9, percentile(angle) + 1e-9, 1e-6)
    check_image(f"{where}, image", errors["image"], reference, variant)

    faults_found = nonfinite + negative + errors["object"]["away"] + errors["shadow"]["away"]
    expect(f"{where}, crossed out", told["crossed_out"], faults_found > 0)
    expect(f"{where}, reasons", len(told["why"]) > 0, faults_found > 0)


def plotted(variant, kind):
    errors = variant["errors"]
    if kind in ("object", "shadow", "path"):
        return errors[kind]["edge"] + errors[kind]["away"]
    if kind in ("shading", "image"):
        return errors[kind]["rmse"]
    return {"t": errors["t"]["relative"]["p99_9"], "normal": errors["normal"]["p99_9"],
            "flip": errors["image"]["flip_mean"]}[kind]


def check_judgement(where, scene):
    variants = scene["variants"]
    times = [variant["frame_ms"]["median"] if "frame_ms" in variant else math.inf for variant in variants]
    sound = [i for i, v in enumerate(variants) if v["status"] == "measured" and not v["crossed_out"]]
    references = [i for i, v in enumerate(variants) if v["status"] == "reference"]
    for i, variant in enumerate(variants):
        for kind, told in variant.get("pareto", {}).items():
            mine = plotted(variant, kind), times[i]
            others = [(plotted(variants[k], kind), times[k]) for k in sound if k != i]
            beaten = any(e <= mine[0] and t <= mine[1] and (e, t) != mine for e, t in others)
            beaten |= any(times[k] < times[i] for k in references)
            expect(f"{where}, variant {i}, on the front of {kind}", told, i in sound and not beaten)
    for pick in scene["picks"]:
        within = references + [i for i in sound if plotted(variants[i], pick["measure"]) <= pick["budget"]]
        expected = min(within, key=lambda i: times[i], default=None)
        expect(f"{where}, pick of {pick['budget']}", pick["variant"], expected)


for scene in report["scenes"]:
    reference = arrays_load(scene["reference"]["saved"], scene["lights"])
    edges = {"object": edges_of(reference["object"]), "path": edges_of(reference["path"])}
    lights = [edges_of(reference["shadow"][:, :, i]) for i in range(scene["lights"])]
    edges["shadow"] = np.stack(lights, axis=2) if lights else np.zeros(reference["shadow"].shape, bool)
    expect(f"{scene['scene']}, silhouettes", scene["edges"]["silhouette"], int(edges["object"].sum()))
    expect(f"{scene['scene']}, paths' edges", scene["edges"]["path"], int(edges["path"].sum()))
    expect(f"{scene['scene']}, shadows' edges", scene["edges"]["shadow"], [int(light.sum()) for light in lights])
    edges["shadow"] |= edges["object"][:, :, None]
    for index, variant in enumerate(scene["variants"]):
        if variant["status"] == "measured":
            check_variant(f"{scene['scene']}, variant {index}", scene, variant, reference, edges)
    check_judgement(scene["scene"], scene)

print(f"{faults} of {checked} figures differ" if faults else f"all {checked} figures agree")
sys.exit(faults > 0)
