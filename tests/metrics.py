"""Computes image metrics by numpy and flip-evaluator (the authors' own FLIP), which share no code with glint."""
from glint import need_modules

need_modules("numpy=numpy==2.4.6", "flip_evaluator=flip-evaluator==1.7")
import flip_evaluator  # noqa: E402
import numpy as np  # noqa: E402


def srgb_encode(linear):
    linear = np.clip(np.nan_to_num(linear, nan=0), 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def srgb_decode(display):
    return np.where(display <= 0.04045, display / 12.92, ((display + 0.055) / 1.055) ** 2.4)


def psnr(mean_square):
    return float(-10 * np.log10(mean_square)) if mean_square > 0 else np.inf


def percentile_99_9(values):
    return float(np.quantile(values, 0.999, method="inverted_cdf"))


def srgb8_distance(encoded_reference, encoded):
    """Returns the distance of display values in steps of 1/255."""
    return np.abs(np.floor(255 * encoded_reference + 0.5) - np.floor(255 * encoded + 0.5))


def flip(encoded_reference, encoded):
    """Returns FLIP's map and its mean, in float as flip-evaluator computes them."""
    images = encoded_reference.astype(np.float32), encoded.astype(np.float32)
    return flip_evaluator.evaluate(*images, "LDR", inputsRGB=True, applyMagma=False, computeMeanError=True,
                                   parameters={"ppd": 67})[:2]
