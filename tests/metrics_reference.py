#!/usr/bin/env python3
"""The numbers of glint diff against numpy and flip-evaluator (the authors' own FLIP), which share no code with glint.

usage: metrics_reference.py GLINT SCRATCH
"""
import json
import subprocess
import sys

import flip_evaluator
import numpy as np

glint, scratch = sys.argv[1:]
faults = 0


def srgb_encode(linear):
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def srgb_decode(display):
    return np.where(display <= 0.04045, display / 12.92, ((display + 0.055) / 1.055) ** 2.4)


def expected_numbers(reference, picture, is_display):
    """What glint diff should say of two arrays, height x width x 3."""
    reference, picture = reference.astype(np.float64), picture.astype(np.float64)
    encoded = [a if is_display else srgb_encode(np.nan_to_num(a, nan=0)) for a in (reference, picture)]
    light = [srgb_decode(a) if is_display else a for a in (reference, picture)]
    both = np.isfinite(light[0]) & np.isfinite(light[1])
    expected, found = light[0][both], light[1][both]
    difference = found - expected
    steps = [np.floor(255 * a + 0.5) for a in encoded]
    distance = np.abs(steps[0] - steps[1])
    map_, mean, _ = flip_evaluator.evaluate(
        encoded[0].astype(np.float32), encoded[1].astype(np.float32), "LDR", inputsRGB=True, applyMagma=False,
        computeMeanError=True, parameters={"ppd": 67})
    # number and tolerance; flip-evaluator works in float
    return {
        "linear": {
            "values": (int(both.sum()), 0),
            "max_abs": (np.abs(difference).max(), 1e-7),
            "rmse": (np.sqrt(np.mean(difference**2)), 1e-7),
            "bias": (difference.mean(), 1e-7),
            "p99_9": (np.quantile(np.abs(difference), 0.999, method="inverted_cdf"), 1e-7),
            "psnr": (10 * np.log10(1 / np.mean(difference**2)), 1e-4),
            "rel_mse": (np.mean(difference**2 / (expected**2 + 0.01)), 1e-5),
        },
        "srgb8": {
            "off_by_1": (int((distance == 1).sum()), 0),
            "off_by_2_or_more": (int((distance > 1).sum()), 0),
            "psnr": (10 * np.log10(255**2 / np.mean(distance**2)), 1e-4),
        },
        "flip": {"mean": (mean, 2e-5), "max": (map_.max(), 2e-4)},
        "nonfinite_pixels": {
            "reference": (int((~np.isfinite(reference)).any(axis=2).sum()), 0),
            "picture": (int((~np.isfinite(picture)).any(axis=2).sum()), 0),
        },
    }


def save(name, array, is_display):
    """As NPY, or as PPM, whose 8-bit values the array then is rounded to."""
    if not is_display:
        np.save(f"{scratch}/{name}.npy", array.astype(np.float32))
        return f"{scratch}/{name}.npy", array.astype(np.float32)
    steps = np.round(255 * np.clip(array, 0, 1)).astype(np.uint8)
    with open(f"{scratch}/{name}.ppm", "wb") as file:
        file.write(b"P6\n%d %d\n255\n" % (steps.shape[1], steps.shape[0]) + steps.tobytes())
    return f"{scratch}/{name}.ppm", (steps / np.float32(255)).astype(np.float32)


def compare(name, reference, picture, is_display=False):
    global faults
    reference_path, reference = save("reference", reference, is_display)
    picture_path, picture = save("picture", picture, is_display)
    run = subprocess.run([glint, "diff", reference_path, picture_path, "--json"], stdout=subprocess.PIPE)
    if run.returncode != 3:
        print(f"{name}: exit status {run.returncode}")
        faults += 1
        return
    told = json.loads(run.stdout)
    for group, numbers in expected_numbers(reference, picture, is_display).items():
        for key, (expected, tolerance) in numbers.items():
            found = told[group][key]
            scale = max(1, abs(expected)) if group == "linear" else 1
            found = np.inf if found is None else found  # JSON has no infinity
            if found != expected and not abs(found - expected) <= tolerance * scale:
                print(f"{name}: {group}.{key} is {found}, expected {expected}")
                faults += 1


def smooth(generator, height, width):
    y, x = np.mgrid[0:height, 0:width] / max(height, width)
    waves = generator.uniform(1, 25, (3, 2))
    return np.stack([0.5 + 0.5 * np.sin(a * x + b * y) for a, b in waves], axis=2)


np.seterr(divide="ignore")
generator = np.random.default_rng(20)
for height, width in (48, 64), (5, 90), (1, 1), (33, 7):
    base = smooth(generator, height, width)
    size = f"{width}x{height}"
    for noise in 1e-5, 1e-2, 0.3:
        noisy = base + generator.normal(0, noise, base.shape)
        compare(f"light, {size}, noise {noise}", base, noisy)
        if noise > 1e-3:
            compare(f"display, {size}, noise {noise}", base, noisy, is_display=True)
    compare(f"beyond the range, {size}", 4 * base - 1, 4 * base - 1.01)
    compare(f"unrelated, {size}", base, generator.uniform(0, 1, base.shape))
    edges = (base > 0.5).astype(float)
    compare(f"edges, {size}", edges, 1 - edges, is_display=True)

gray = np.full((64, 64, 3), 128 / 255)
black = gray.copy()
black[20, 40] = 0
compare("one black pixel", gray, black, is_display=True)
compare("one step lighter", gray, gray + 1 / 255, is_display=True)
holes = gray + 0.001
holes[3, 5, 1] = np.nan
holes[9, 9, 0] = -np.inf
compare("not finite", gray, holes)

print(f"{faults} numbers differ" if faults else "all numbers agree")
sys.exit(faults > 0)
