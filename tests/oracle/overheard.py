#!/usr/bin/env python3
"""Holds the oracle of glint verify's pictures (host/verify/exact.c, in long double) and the pictures themselves
to the exact oracle.

usage: overheard.py OVERHEAR FOLDER [--long] [--spoil PART]

OVERHEAR (tools/numerics/overhear.c) runs verify's own cases and tells what the oracle was asked and answered. Each answer
is held to a hundredth of what tier D would grant a renderer, so that what tier D judges is not the judge's rounding;
the margin, by which a decision is left open, to a quarter of tier D's band, and whether there is a hit must be right but
where the margin is smaller than that. Then pixels of each picture are traced by color.py, as in pictures.py.

Prints what was compared and the worst errors as parts of their bounds; exit status 1 if one is beyond its bound, if too
little was compared (not asked where --cases names them) or if more than a fifth of a case's values is open at
`double`. --spoil: moves each answer by so much of itself first, to show that it is noticed."""

import argparse
import json
import pathlib
import subprocess
import sys
from collections import Counter
from fractions import Fraction
from math import inf

import exact
import pictures
import write_tables
from color import Beam, as_float, rim_distance, trace
from exact import dot, fraction, rational, subtract
from flint import arb
from scene import Scene, Thing, unit

# The cases that ask the pictures' oracle, and those that only have pictures; the others have rays, which the tables
# of write_tables.py answer, and at whose hits the distance to the surface is asked.
ASKING = "S2 S4 C3 T1 T5 R1 R2 R5"
SHOWING = "P1 P2 P6 C6 R3 R6 R7"
TOUCHING = "S1 P5 C4 T2 M4"
# Of the questions of a case one of so many is put to the exact oracle; 4000 where it is not here.
EVERY = {"S2": 16000, "C3": 100, "T1": 2000, "T5": 4000}
U = Fraction(1, 2**53)
PART = Fraction(1, 100)
BAND = Fraction(16, 4) * U

# At least so many answers of each kind have to be compared, at both precisions together.
LEAST = {
    "sphere: hit or miss": 2000,
    "sphere: t": 1000,
    "sphere: margin": 1000,
    "plane: hit or miss": 100,
    "plane: t": 50,
    "cylinder: hit or miss": 20,
    "cylinder: t": 5,
    "cylinder: margin": 5,
    "torus: hit or miss": 1000,
    "torus: t": 40,
    "torus: margin": 20,
    "highlight": 500,
    "highlight: lit": 100,
    "surface": 300,
}


class Tallies:
    """Of each kind of value how many were compared, and the worst error as a part of its bound."""

    def __init__(self):
        self.counts, self.worst, self.wrong = Counter(), {}, 0

    def take(self, kind, error, bound, what):
        self.counts[kind] += 1
        part = float(error / bound) if bound > 0 else (inf if error > 0 else 0.0)
        self.worst[kind] = max(self.worst.get(kind, 0.0), part)
        if not part <= 1:
            self.wrong += 1
            if self.wrong <= 20:
                print(f"  {kind} is off by {part:.3g} of its bound: {what}")


def long(pair):
    """A long double, told as a double and the rest of it."""
    return Fraction(pair[0]) + Fraction(pair[1])


def solid_of(sample, part=0):
    """The shape asked about, its radius changed by a part of itself."""
    kind = sample["kind"]
    if kind == "plane":
        return exact.Plane(sample["point"], sample["normal"])
    if kind == "torus":
        return exact.Torus(sample["center"], sample["major"], Fraction(sample["minor"]) * (1 + part))
    radius = Fraction(sample["radius"]) * (1 + part)
    if kind == "sphere":
        return exact.Sphere(sample["center"], radius)
    return exact.Revolution(sample["point"], sample["axis"], [radius] * 2, endless=True)


def is_met(shape, ray):
    """Whether the line meets the solid, before the ray's start or beyond it."""
    return bool(shape.crossings(ray))


def margin_holds(sample, ray, margin, band):
    """1 - (l / r)^2 is told by a solid that the line just touches: of radius l it is met if a little larger, missed if
    a little smaller."""
    squared = 1 - margin
    root = fraction(arb(rational(squared)).sqrt())
    change = band / 2 / squared
    return is_met(solid_of(sample, root * (1 + change) - 1), ray) and not is_met(
        solid_of(sample, root * (1 - change) - 1), ray
    )


def check_hit(sample, tallies, spoil):
    kind, ray = sample["kind"], exact.Ray([0, 0, 0], sample["direction"])
    shape, t = solid_of(sample), None
    margin = inf if sample["margin"][0] is None else long(sample["margin"])
    nearly = kind != "plane" and margin != inf and abs(margin) <= BAND
    t = shape.hit(ray)
    if not nearly:
        tallies.take(f"{kind}: hit or miss", int(sample["found"] != (t is not None)), 0, sample)
    # of a torus that is clearly missed the margin only tells that
    if kind != "plane" and abs(margin) < (Fraction(1, 10) if kind == "torus" else 1):
        tallies.take(f"{kind}: margin", 0 if margin_holds(sample, ray, margin * (1 + spoil), BAND) else 2, 1, sample)
    if t is None or not sample["found"] or nearly:
        return
    told, cosine = long(sample["t"]) * (1 + spoil), Fraction(shape.cosine(ray, t))
    length = Fraction(ray.scale)
    size = Fraction(shape.size)
    owed = 4 * Fraction(write_tables.WIDE.ulp(as_float(t))) + 4 * U * size / cosine / length
    tallies.take(f"{kind}: t", abs(told - fraction(t)), PART * owed, sample)
    tallies.take(f"{kind}: cosine", abs(long(sample["cosine"]) * (1 + spoil) - cosine), Fraction(1, 2**40), sample)
    # the normal turns by what its place is off over the radius
    bend = 0 if kind == "plane" else 1 / Fraction(shape.radius)
    normal = [fraction(x) for x in unit(shape.normal([exact.middle(x) for x in ray.at(t)]))]
    off = max(abs(long(sample[axis]) * (1 + spoil) - n) for axis, n in zip("xyz", normal))
    tallies.take(f"{kind}: normal", off, PART * (8 * U + owed * length * bend), sample)


def check_highlight(sample, tallies, spoil):
    """Phong's term as Phong has it: (R . V)^power, R = 2 (N . L) N - L."""
    n, to_light, ray = (unit([rational(x) for x in sample[key]]) for key in ("normal", "to_light", "direction"))
    facing, told = dot(n, to_light), long(sample["value"]) * (1 + spoil)
    mirrored = subtract([2 * facing * x for x in n], to_light)
    alignment = -dot(mirrored, ray)
    value = arb(0)
    if facing > 0 and sample["power"] == 0:
        value = arb(1)
    elif facing > 0 and alignment > 0:
        value = (rational(sample["power"]) * alignment.log()).exp()
    # a hundredth of what R5 asks, and the 1e6 times u that the power makes of a rounding
    tallies.take("highlight", abs(told - fraction(value)), PART * Fraction(1, 10**4) / 2**20, sample)
    tallies.counts["highlight: lit"] += told > Fraction(1, 1000)


def check_surface(sample, tallies, width):
    """Where the exact ray meets the surface steeply and away from edges, a place off along the ray by so much is off the
    surface by that times the cosine, but for the curvature."""
    rounding = width.rounding

    def from_eye(point):
        return exact.vector(rounding(float(x)) for x in point)

    ((kind, given),) = sample["object"].items()
    shape = Thing(kind, given, None, from_eye, rounding).shape
    ray = exact.Ray(sample["origin"], sample["direction"])
    told, distance = Fraction(sample["t"]), long(sample["distance"])
    met = min(shape.crossings(ray), key=lambda t: abs(fraction(t) - told), default=None)
    if met is None:
        return
    cosine, off = Fraction(shape.cosine(ray, met)), abs(fraction(met) - told) * Fraction(ray.scale)
    magnitude = Fraction(exact.length(ray.origin) + shape.distance(ray) + shape.size)
    if cosine < Fraction(1, 10) or rim_of(shape, ray, met) < 100 * off + 2**-40 * magnitude:
        return
    curved = 0 if isinstance(shape, (exact.Plane, exact.Box)) else off * off / Fraction(shape.radius)
    # a 16th of an ulp of double: its place and the surface are worked out in numbers as large as this
    tallies.take("surface", abs(distance - off * cosine), U / 16 * magnitude + 4 * curved, sample)


def rim_of(shape, ray, t):
    """How far the crossing is from an edge."""
    if isinstance(shape, exact.Disc):
        return abs(exact.length(subtract(ray.at(t), shape.center)) - shape.radius)
    if isinstance(shape, exact.Triangle):
        return inf if shape.margin(ray) > 1e-6 else 0
    return rim_distance(shape, ray.at(t))


def overhear(program, folder, case, precision, every, pixels):
    output = folder / "overheard.json"
    command = [program, output, str(every), str(pixels), case, "--precision", precision, "--json"]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        sys.exit(f"overheard.py: {case} at {precision}: exit status {done.returncode}\n{done.stdout}")
    return json.loads(output.read_text())["samples"]


def show(picture, precision, tallies, name, spoil):
    """Pixels of a picture against color.py."""
    width = write_tables.WIDE if precision == "double" else write_tables.NARROW
    scene, rounding = Scene(picture["scene"], width), pictures.ROUNDINGS[precision]
    for pixel in picture["pixels"]:
        seen = dict(pixel)
        seen["t"] = inf if pixel["t"] is None else pixel["t"] * (1 + float(spoil))
        seen["color"] = [x * (1 + float(spoil)) for x in pixel["color"]]
        answer = trace(scene, Beam((0, 0, 0), pixel["ray"]), rounding, 5)
        pictures.compare_pixel(answer, seen, rounding, tallies, f"{name}, pixel {pixel['pixel']}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--long", action="store_true")
    parser.add_argument("--spoil", type=Fraction, default=Fraction(0))
    parser.add_argument("--cases")
    options = parser.parse_args()
    tallies, is_right = Tallies(), True
    for case in (options.cases or f"{ASKING} {SHOWING} {TOUCHING}").split():
        for precision in ("single", "double"):
            seen = {kind: pictures.Tally() for kind in ("object", "t", "normal", "shadow", "color")}
            every, pixels = EVERY.get(case, 4000), 16
            if options.long:
                every, pixels = every // 10, 100
            for sample in overhear(options.program, options.folder, case, precision, every, pixels):
                if sample["kind"] == "picture":
                    show(sample, precision, seen, f"{case} at {precision}", options.spoil)
                elif sample["kind"] == "highlight":
                    check_highlight(sample, tallies, options.spoil)
                elif sample["kind"] == "surface":
                    check_surface(sample, tallies, write_tables.WIDE if precision == "double" else write_tables.NARROW)
                else:
                    check_hit(sample, tallies, options.spoil)
            if seen["object"].count + seen["object"].open == 0:
                continue
            wrong = sum(tally.wrong for tally in seen.values())
            counts = ", ".join(f"{kind} {t.count} ({t.open} open, {t.part:.2g})" for kind, t in seen.items())
            print(f"{case} {precision}: {wrong} wrong; {counts}", flush=True)
            is_open = any(t.open > 0.2 * (t.count + t.open) for t in seen.values())
            is_right = is_right and wrong == 0 and not (precision == "double" and is_open)
    for kind, count in sorted(tallies.counts.items()):
        worst = f", worst {tallies.worst[kind]:.3g} of the bound" if kind in tallies.worst else ""
        print(f"{kind:24} {count:6} compared{worst}")
    for kind, least in LEAST.items() if not options.cases else ():
        if tallies.counts[kind] < least:
            is_right = False
            print(f"{kind}: of these at least {least} are to be compared")
    sys.exit(0 if is_right and tallies.wrong == 0 else 1)


if __name__ == "__main__":
    main()
