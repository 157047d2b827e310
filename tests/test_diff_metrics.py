#!/usr/bin/env -S python3 -B
"""Compares the numbers of glint diff with numpy and flip-evaluator (the authors' own FLIP), which share no code with glint."""
import math
from pathlib import Path

from glint import TestCase, main
from metrics import flip, np, percentile_99_9, psnr, srgb8_distance, srgb_decode, srgb_encode


def expected_metrics(reference, image, is_display):
    """Returns each number of the report on two arrays, height x width x 3, and its tolerance."""
    reference, image = reference.astype(np.float64), image.astype(np.float64)
    encoded = [a if is_display else srgb_encode(a) for a in (reference, image)]
    light = [srgb_decode(a) if is_display else a for a in (reference, image)]
    both = np.isfinite(light[0]) & np.isfinite(light[1])
    expected, found = light[0][both], light[1][both]
    difference = found - expected
    distance = srgb8_distance(*encoded)
    flip_map, flip_mean = flip(*encoded)
    return {
        "linear": {
            "values": (int(both.sum()), 0),
            "max_abs": (np.abs(difference).max(), 1e-7),
            "rmse": (np.sqrt(np.mean(difference**2)), 1e-7),
            "bias": (difference.mean(), 1e-7),
            "p99_9": (percentile_99_9(np.abs(difference)), 1e-7),
            "psnr": (psnr(np.mean(difference**2)), 1e-4),
            "rel_mse": (np.mean(difference**2 / (expected**2 + 0.01)), 1e-5),
        },
        "srgb8": {
            "off_by_1": (int((distance == 1).sum()), 0),
            "off_by_2_or_more": (int((distance > 1).sum()), 0),
            "psnr": (psnr(np.mean(distance**2) / 255**2), 1e-4),
        },
        "flip": {"mean": (flip_mean, 2e-5), "max": (flip_map.max(), 2e-4)},
        "nonfinite_pixels": {
            "reference": (int((~np.isfinite(reference)).any(axis=2).sum()), 0),
            "image": (int((~np.isfinite(image)).any(axis=2).sum()), 0),
        },
    }


def save(name, array, is_display):
    """Writes an NPY, or a PPM of 8 bits. Returns its path and the values that it holds."""
    if not is_display:
        np.save(f"{name}.npy", array.astype(np.float32))
        return f"{name}.npy", array.astype(np.float32)
    steps = np.round(255 * np.clip(array, 0, 1)).astype(np.uint8)
    Path(f"{name}.ppm").write_bytes(b"P6\n%d %d\n255\n" % (steps.shape[1], steps.shape[0]) + steps.tobytes())
    return f"{name}.ppm", (steps / np.float32(255)).astype(np.float32)


def waves(generator, height, width):
    y, x = np.mgrid[0:height, 0:width] / max(height, width)
    return np.stack([0.5 + 0.5 * np.sin(a * x + b * y) for a, b in generator.uniform(1, 25, (3, 2))], axis=2)


def pairs():
    """Yields name, reference, image, and whether both are display values."""
    generator = np.random.default_rng(20)
    for height, width in (48, 64), (5, 90), (1, 1), (33, 7):
        base = waves(generator, height, width)
        size = f"{width}x{height}"
        for noise in 1e-5, 1e-2, 0.3:
            noisy = base + generator.normal(0, noise, base.shape)
            yield f"linear, {size}, noise {noise}", base, noisy, False
            if noise > 1e-3:
                yield f"display, {size}, noise {noise}", base, noisy, True
        yield f"beyond the range, {size}", 4 * base - 1, 4 * base - 1.01, False
        yield f"unrelated, {size}", base, generator.uniform(0, 1, base.shape), False
        edges = (base > 0.5).astype(float)
        yield f"edges, {size}", edges, 1 - edges, True
    gray = np.full((64, 64, 3), 128 / 255)
    black = gray.copy()
    black[20, 40] = 0
    yield "one black pixel", gray, black, True
    yield "one step lighter", gray, gray + 1 / 255, True
    holes = gray + 0.001
    holes[3, 5, 1] = np.nan
    holes[9, 9, 0] = -np.inf
    yield "not finite", gray, holes, False


class DiffMetrics(TestCase):
    def test_metrics(self):
        for name, reference, image, is_display in pairs():
            reference_path, reference = save("reference", reference, is_display)
            image_path, image = save("image", image, is_display)
            report = self.json(f"diff {reference_path} {image_path} --json", status=3)
            for group, metrics in expected_metrics(reference, image, is_display).items():
                for key, (expected, tolerance) in metrics.items():
                    found = math.inf if report[group][key] is None else report[group][key]  # JSON has no infinity
                    scale = max(1, abs(expected)) if group == "linear" else 1
                    with self.subTest(f"{name}: {group}.{key}"):
                        self.assertTrue(found == expected or abs(found - expected) <= tolerance * scale,
                                        f"{found}, expected {expected}")


if __name__ == "__main__":
    main()
