#!/usr/bin/env python3
"""Checks the reference (host/verify/reference.h) in exact arithmetic.

usage: { answers 24; answers image 16 12; } | certify.py [--long] [--spoil PART] [--set NAME]

tests/oracle/answers.c prints rays of the hard cases and random ones with what the reference answers. Hit or miss has to
be right wherever the margin is not smaller than quadruple precision resolves; t, the cosine and the normal within a
thousandth of what `double` could see. The margin, by which tiers leave hit or miss open, must never be larger than what
decides: a solid grown or shrunk by less answers the same. Nor may it always be small: grown or shrunk by four times as
much most solids answer otherwise.

It also prints what the pixels of tests/exact_scenes.txt show. Their objects, paths and shadows have to be right, and their colors
within COLOR.

Prints what was compared and the worst errors as parts of their bounds; exit status 1 if one is beyond its bound or too
little was compared. In large families the first 200 rays are checked, with --long all of them. --spoil first changes each
answer by this part of itself, to show that it is noticed. --set selects one set of rays."""

import argparse
import json
import sys
from collections import Counter
from fractions import Fraction

import exact
import yaml
from color import Pixel
from exact import fraction, grown
from scene import Scene

sys.path.insert(0, "tests")
from scene_tables import scenes

PART = Fraction(1, 2**62)
COLOR = Fraction(1, 2**50)  # the reference adds up colors in double
RESOLVED = 2.0**-80  # margins below this part of the size may be lost in roundings
BEND = 0.01  # margins up to this part of the radius are proportional to distances
SHAPES = "sphere", "plane", "disc", "box", "cylinder", "cone", "paraboloid", "superellipsoid", "triangle", "torus"
SHORT = 200  # rays of a set
LEAST = {"hit or miss": 100, "t": 60, "normal": 60}  # of each shape


class Set:
    """A scene and what rays at it should hit. bounces: of an image's rays, else None."""

    def __init__(self, name, bounces=None):
        self.name, self.bounces, self.given, self.rays = name, bounces, [], []


def sets_read(stream):
    sets = []
    for line in stream:
        entry = json.loads(line)
        if "set" in entry:
            sets.append(Set(entry["set"]))
        elif "scene" in entry:
            sets.append(Set(entry["scene"], entry["bounces"]))
        elif "shape" in entry:
            sets[-1].given.append(entry)
        else:
            sets[-1].rays.append(entry)
    return sets


class Near:
    """Finds the shapes of a mesh that a ray comes as near to as they are large."""

    def __init__(self, shapes):
        self.shapes = [(shape, *exact.floats(shape.center), shape.size**2) for shape in shapes]

    def find(self, ray):
        ox, oy, oz = exact.floats(ray.origin)
        dx, dy, dz = exact.floats(ray.direction)
        dd = dx * dx + dy * dy + dz * dz
        found = []
        for shape, x, y, z, squared in self.shapes:
            x, y, z = x - ox, y - oy, z - oz
            along = x * dx + y * dy + z * dz
            if x * x + y * y + z * z - along * along / dd <= 1.001 * squared:
                found.append(shape)
        return found


class Tallies:
    """The number of compared values of each type, and the worst error as a part of its bound."""

    def __init__(self, spoil):
        self.spoil, self.counts, self.worst, self.wrong = spoil, Counter(), {}, 0

    def record(self, kind, error, bound, what):
        self.counts[kind] += 1
        part = float(error / bound) if bound > 0 else (float("inf") if error > 0 else 0.0)
        self.worst[kind] = max(self.worst.get(kind, 0.0), part)
        if not part <= 1:
            self.wrong += 1
            self.counts[f"{kind}: wrong"] += 1
            if self.counts[f"{kind}: wrong"] <= 3:
                print(f"  {kind} is off by {part:.3g} of its bound: {what}")

    def spoiled(self, pair):
        """Returns a number printed as a double and the remainder, changed by the part that --spoil names."""
        return (Fraction(pair[0]) + Fraction(pair[1])) * (1 + self.spoil)


def check_hit(kind, shapes, ray, given, tallies):
    hits = [(t, i) for i, t in enumerate(shape.hit(ray) for shape in shapes) if t is not None]
    size = max((shape.size for shape in shapes), default=1.0) or 1.0
    if given["margin"] > RESOLVED * size:
        tallies.record(f"{kind}: hit or miss", int(given["found"] != bool(hits)), 0, given)
    if not hits or not given["found"]:
        return
    t, index = min(hits)
    shape, cosine = shapes[index], given["cosine"][0]
    spread = PART * (fraction(t) + Fraction(shape.size or shape.distance(ray)) / Fraction(max(cosine, 1e-25) * ray.scale))
    tallies.record(f"{kind}: t", abs(tallies.spoiled(given["t"]) - fraction(t)), spread, given)
    if len(shapes) > 1 or cosine < 1e-6:
        return  # any of the triangles that share the point may be the first
    tallies.record(f"{kind}: cosine", abs(tallies.spoiled(given["cosine"]) - Fraction(shape.cosine(ray, t))), Fraction(1, 2**40), given)
    outward = shape.normal([exact.middle(x) for x in ray.at(t)])
    length = (exact.dot(outward, outward) * exact.arb(1)).sqrt()
    side = -1 if fraction(exact.dot(outward, ray.direction)) > 0 else 1
    normal = [fraction(side * x / length) for x in outward]
    off = max(abs(tallies.spoiled(given[axis]) - n) for axis, n in zip("xyz", normal))
    bend = Fraction(shape.size / shape.radius) if shape.radius else 1
    # at an edge a box has a normal of each face
    if not isinstance(shape, exact.Box) or sum(x != 0 for x in outward) == 1:
        tallies.record(f"{kind}: normal", off, PART * (1 + bend / Fraction(cosine)), given)


def check_margin(kind, shape, ray, given, tallies):
    margin, limit = given["margin"] * float(1 + tallies.spoil), BEND * (shape.radius or 1)
    if isinstance(shape, exact.Box):
        limit = BEND * min(shape.half)
    if isinstance(shape, exact.Paraboloid):
        limit = BEND * shape.least
    is_fixed = isinstance(shape, exact.Plane)  # nothing of it grows
    # in a face of a box hit or miss is a comparison of given numbers
    is_compared = isinstance(shape, exact.Box) and sum(x == 0 for x in ray.direction) == 2
    if is_fixed or is_compared or margin <= RESOLVED * shape.size:
        return

    def is_found(by):
        return grown(shape, by).hit(ray) is not None

    # an edge moves by more than its faces
    within = (0.49 if isinstance(shape, (exact.Sphere, exact.Torus)) else 0.2) * min(margin, limit)
    held = all(is_found(by) == given["found"] for by in (within, -within))
    tallies.record(f"{kind}: margin", int(not held), 0, given)
    if margin < limit and not shape.contains(ray.origin):
        tallies.counts["narrow margins"] += 1
        tallies.counts["tight margins"] += any(is_found(by) != given["found"] for by in (2 * margin, -2 * margin))


def check_image(set_, given, tallies):
    """Checks the pixels of an image of a scene of tests/exact_scenes.txt."""
    scene = Scene(given)
    for pixel in set_.rays:
        direction = [sum(map(Fraction, pixel[axis])) for axis in "xyz"]
        answer = Pixel(scene, exact.Ray(given["camera"]["position"], direction), set_.bounces)
        where = f"{set_.name}: {pixel}"
        tallies.record("pixel: object", int(answer.object != pixel["object"]), 0, where)
        tallies.record("pixel: path", int(answer.path != pixel["path"]), 0, where)
        if answer.shadows is not None:
            tallies.record("pixel: shadows", int(answer.shadows != pixel["shadows"]), 0, where)
        off = max(abs(tallies.spoiled([x, 0]) - fraction(y)) for x, y in zip(pixel["color"], answer.color))
        tallies.record("pixel: color", off, COLOR, where)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--spoil", type=Fraction, default=Fraction(0))
    parser.add_argument("--long", action="store_true")
    parser.add_argument("--set")
    options = parser.parse_args()
    tallies = Tallies(options.spoil)
    images = {scene.name: yaml.safe_load(scene.content) for scene in scenes("tests/exact_scenes.txt")}
    for set_ in sets_read(sys.stdin):
        if options.set not in (None, set_.name):
            continue
        if set_.bounces is not None:
            check_image(set_, images[f"{set_.bounces} {set_.name}"], tallies)
            continue
        shapes = [exact.shape_of(given) for given in set_.given]
        kind = set_.given[0]["shape"]
        near = Near(shapes) if len(shapes) > 1 else None
        for given in set_.rays[: None if options.long else SHORT]:
            ray = exact.Ray(given["origin"], given["direction"], given["start"])
            check_hit(kind, near.find(ray) if near else shapes, ray, given, tallies)
            if not near:
                check_margin(kind, shapes[0], ray, given, tallies)
    for kind, count in sorted(tallies.counts.items()):
        worst = f", worst {tallies.worst[kind]:.3g} of the bound" if kind in tallies.worst else ""
        print(f"{kind:24} {count:6} compared{worst}")
    counts = tallies.counts
    is_enough = all(counts[f"{shape}: {kind}"] >= least for shape in SHAPES for kind, least in LEAST.items())
    is_enough = is_enough and counts["pixel: color"] >= 2000
    is_tight = counts["tight margins"] >= counts["narrow margins"] / 2 > 50
    sys.exit(0 if is_enough and is_tight and tallies.wrong == 0 else 1)


if __name__ == "__main__":
    main()
