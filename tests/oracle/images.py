#!/usr/bin/env python3
"""Compares small images of glint with the oracle, pixel by pixel: objects, distances, normals, shadows, colors.

usage: images.py GLINT FOLDER [--long]

For each precision it prints what was compared, what was open, and the worst errors; exit status 1 if one is beyond its
bound."""

import pathlib
import subprocess
import sys

import numpy
import yaml
from color import Beam, Rounding, as_float, trace
from scene import Scene, narrow

STAGE = """
camera: {position: [0.5, 1.75, 6], look_at: [0, 0.5, 0], fov: 40}
background: [0.125, 0.25, 0.5]
ambient: [0.125, 0.125, 0.25]
lights:
  - point: {position: [4, 6, 5], color: [1, 0.75, 0.5], intensity: 0.5}
  - directional: {direction: [3, -6, -2], color: [0.25, 0.5, 0.75]}
  - spot: {position: [-3, 5, 3], look_at: [0, 0, 0], angle: 16, penumbra: 8, intensity: 12, falloff: {linear: 1, quadratic: 0.25}}
materials:
  floor: {checker: {colors: [[1, 1, 1], [0.25, 0.25, 0.25]], size: 0.75}, diffuse: 0.75}
  red: {color: [0.875, 0.25, 0.125], diffuse: [0.75, 0.5, 0.5], specular: 0.5, shininess: 24}
  tiles: {checker: {colors: [[0.25, 0.5, 1], [1, 1, 0.5]], size: 0.375}, diffuse: 0.5, specular: 0.25, shininess: 300}
  veil: {color: [0.5, 1, 0.5], diffuse: 0.5, transmission: 0.5, ior: 1}
  mirror: {color: [0.5, 0.5, 0.5], diffuse: 0.25, specular: [0.5, 0.375, 0.125], shininess: 1000, reflection: [0.75, 0.5, 0.25]}
  glass: {color: [1, 1, 1], diffuse: 0.125, reflection: 0.125, transmission: 0.75, ior: 1.5}
  clear: {color: [1, 1, 1], diffuse: 0.125, transmission: [0.75, 0.5, 0.25], ior: 1.25, fresnel: true}
  plastic: {color: [0.25, 0.5, 1], diffuse: 0.5, reflection: 0.875, ior: 1.5, fresnel: true, emission: [0.0625, 0, 0.125]}
objects:
  - plane: {point: [0, -0.5, 0], normal: [0, 1, 0], material: floor}
"""

SHAPES = {
    "sphere": ["sphere: {center: [0, 0.5, 0], radius: 1, material: red}"],
    "plane": ["plane: {point: [0, 0, -2], normal: [1, 2, 8], material: tiles}"],
    "disc": ["disc: {center: [0, 0.5, 0], normal: [1, 1, 2], radius: 1.25, material: red}"],
    "box": ["box: {min: [-1.125, -0.5, -0.75], max: [0.75, 0.875, 0.5], material: tiles}"],
    "cylinder": [
        "cylinder: {from: [-1, -0.25, 0], to: [-0.5, 1.25, 0.5], radius: 0.5, material: red}",
        "cylinder: {from: [1, -0.25, 0], to: [1.25, 1, 0.25], radius: 0.5, caps: false, material: red}",
        "cylinder: {point: [0, 0, -2], axis: [2, 1, 0], radius: 0.375, material: tiles}",
    ],
    "cone": [
        "cone: {from: [-1, -0.25, 0], to: [-0.5, 1.25, 0.5], radius: [0.75, 0.25], material: red}",
        "cone: {from: [1, -0.25, 0], to: [1.25, 1, 0.25], radius: [0, 0.5], caps: false, material: red}",
        "cone: {apex: [0, 1, -3], axis: [1, 4, 0], angle: 20, material: tiles}",
    ],
    "torus": ["torus: {center: [0, 0.5, 0], axis: [1, 2, 2], major: 1, minor: 0.375, material: red}"],
    # Tubes wider than their circles; the transparent one has a sphere in it, where it lies in itself.
    "spindle": [
        "torus: {center: [-1, 0.5, 0], axis: [1, 2, 2], major: 0.375, minor: 0.75, material: red}",
        "torus: {center: [1, 0.5, 0.5], axis: [0, 1, 4], major: 0.25, minor: 0.75, material: veil}",
        "sphere: {center: [1, 0.5, 0.5], radius: 0.25, material: red}",
    ],
    "triangle": [
        "triangle: {vertices: [[-1.5, -0.25, 0], [0.5, -0.25, 0.5], [-0.5, 1.5, 0]], material: red}",
        "triangle: {vertices: [[0.5, -0.25, 0], [1.75, 0, 0.5], [1, 1.5, 0]], "
        "normals: [[-1, 0, 2], [1, 0, 2], [0, 1, 2]], material: red}",
    ],
    "veils": [
        "sphere: {center: [-1, 0.5, 0], radius: 0.75, material: veil}",
        "box: {min: [0.25, 0, -0.25], max: [1.25, 1, 0.5], material: veil}",
        "disc: {center: [0, 1.75, 0.5], normal: [1, 4, 1], radius: 0.75, material: veil}",
    ],
    "mirrors": [
        "sphere: {center: [-1, 0.25, 0], radius: 0.75, material: mirror}",
        "box: {min: [0.25, -0.25, -0.25], max: [1.25, 1, 0.5], material: glass}",
        "sphere: {center: [0, 0.75, 2], radius: 0.5, material: glass}",
        "plane: {point: [0, 0, -3], normal: [1, 1, 8], material: mirror}",
    ],
}
SHAPES["shapes"] = [
    SHAPES["plane"][0],
    SHAPES["triangle"][1],
    "disc: {center: [-1.5, 1.5, -0.5], normal: [1, 1, 2], radius: 0.625, material: red}",
    "box: {min: [-0.5, -0.5, 0.5], max: [0.375, 0.25, 1.25], material: clear}",
    "sphere: {center: [1.375, 0.125, 2], radius: 0.375, material: glass}",
    "sphere: {center: [-1.25, -0.125, 1.75], radius: 0.375, material: plastic}",
    "sphere: {center: [-1.375, 0.25, 0.5], radius: 0.5, material: mirror}",
    "torus: {center: [0, 1.25, 0], axis: [1, 2, 2], major: 0.75, minor: 0.25, material: red}",
    "cylinder: {from: [-0.75, -0.5, 1.5], to: [-0.5, 0.25, 1.75], radius: 0.25, caps: false, material: tiles}",
    "cone: {from: [0.875, -0.5, 1], to: [1, 0.5, 1.25], radius: [0.375, 0.125], material: red}",
    "sphere: {center: [0.5, 0.625, 1.5], radius: 0.25, material: veil}",
]
SHAPES["glass"] = [SHAPES["mirrors"][0], SHAPES["mirrors"][1], SHAPES["mirrors"][2], SHAPES["veils"][2]]
SHORT = ("shapes",)  # all but the spindle torus, in one kernel
BOUNCES = 2
KINDS = "t", "normal", "object", "shadow", "ray", "color"

# u, displacement and arithmetic of each precision: docs/measurements/README.md has the reasons.
ROUNDINGS = {
    "single": Rounding(2.0**-24, 4, 4),
    "strict": Rounding(2.0**-24, 2, 4),
    "double": Rounding(2.0**-53, 2, 4),
}


class Tally:
    """The comparison of one type of value, with the worst error in u and as a part of its bound."""

    def __init__(self):
        self.count = self.open = self.wrong = 0
        self.error = self.part = 0.0
        self.where = None

    def record(self, error, bound, where):
        self.count += 1
        self.error = max(self.error, error)
        if not error <= bound:
            self.wrong += 1
        if not error <= self.part * bound:
            self.part, self.where = error / bound if bound else float("inf"), where


def render(glint, scene, precision, size, folder):
    (folder / "scene.yaml").write_text(scene)
    command = [glint, "render", folder / "scene.yaml", "-o", folder / "image.npy", "--quiet"]
    command += ["--precision", precision, "--size", "{}x{}".format(*size)]
    command += ["--bounces", str(BOUNCES), "--aov", ",".join(KINDS)]
    subprocess.run(command, check=True)
    return {kind: numpy.load(folder / f"image.{kind}.npy") for kind in KINDS}


def distance(a, b):
    return numpy.max([abs(float(x) - y) for x, y in zip(a, b)])  # keeps NaN, which Python's max may drop


def compare(scene, image, rounding, tallies, name):
    height, width = image["t"].shape[:2]
    for row in range(height):
        for column in range(width):
            where = f"{name} at {column},{row}"
            ray = [float(x) for x in image["ray"][row, column]]
            answer = trace(scene, Beam((0, 0, 0), ray), rounding, BOUNCES)
            seen = {kind: values[row, column] for kind, values in image.items()}
            compare_pixel(answer, seen, rounding, tallies, where)


def compare_pixel(answer, seen, rounding, tallies, where):
    hit = answer.hit
    if hit == "open":
        tallies["object"].open += 1
        return
    found = int(seen["object"])
    expected = 4294967295 if hit is None else hit.index
    tallies["object"].record(float(found != expected), 0.5, where)
    if found != expected:
        return
    if hit is not None:
        t = float(seen["t"])
        spread = max(hit.high - as_float(hit.t), as_float(hit.t) - hit.low)
        tallies["t"].record(abs(t - as_float(hit.t)) / t, spread / t + 2 * rounding.u, where)
        tallies["normal"].record(distance(seen["normal"], map(as_float, hit.normal)), hit.turn, where)
        for light, expected in enumerate(answer.shadows):
            if expected is None:
                tallies["shadow"].open += 1
            else:
                tallies["shadow"].record(float(bool(seen["shadow"][light]) != expected), 0.5, where)
    if answer.color is None:
        tallies["color"].open += 1
    else:
        error = distance(seen["color"], map(as_float, answer.color.color))
        tallies["color"].record(error, answer.color.error + 2 * rounding.u, where)


def main(glint, folder, is_long):
    folder = pathlib.Path(folder)
    size = (48, 36) if is_long else (24, 18)
    is_right = True
    for precision, rounding in ROUNDINGS.items():
        tallies = {kind: Tally() for kind in ("object", "t", "normal", "shadow", "color")}
        for name in SHAPES if is_long else SHORT:
            text = STAGE + "".join(f"  - {line}\n" for line in SHAPES[name])
            image = render(glint, text, precision, size, folder)
            scene = Scene(yaml.safe_load(text), float if precision == "double" else narrow)
            compare(scene, image, rounding, tallies, name)
        print(precision)
        for kind, tally in tallies.items():
            line = f"  {kind:8}{tally.count:7} compared, {tally.open} open, {tally.wrong} wrong"
            if kind in ("t", "normal", "color"):
                line += f"; worst {tally.error / rounding.u:.3g} u, {tally.part:.3g} of its bound"
            print(line + (f" ({tally.where})" if tally.part else ""), flush=True)
            is_right = is_right and tally.wrong == 0 and tally.open < 0.1 * (tally.count + tally.open)
    return 0 if is_right else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2], "--long" in sys.argv[3:]))
