#!/usr/bin/env python3
"""Writes host/verify/tables.c: what the probe cases ask and what the exact answers are."""

import struct
import sys
from math import frexp, inf, ldexp

import exact
import families
from cases import SETS

SAMPLE = 160
MESH_SAMPLE = 60
MISS = "MISS"
ANY = "ANY_OBJECT"


def narrow(number):
    return struct.unpack("f", struct.pack("f", number))[0]


def wide(number):
    return float(number)


class Width:
    def __init__(self, name, rounding, bits, tiers):
        self.name, self.rounding, self.bits, self.tiers = name, rounding, bits, tiers
        self.u = 2.0**-bits

    def ulp(self, number):
        return ldexp(1.0, frexp(number)[1] - self.bits)

    def next(self, number, sign):
        """One unit in the last place up or down in magnitude."""
        fmt = ("f", "I") if self.bits == 24 else ("d", "Q")
        bits = struct.unpack(fmt[1], struct.pack(fmt[0], number))[0]
        return struct.unpack(fmt[0], struct.pack(fmt[1], bits + sign))[0]

    def neighbors(self, given):
        """The ray itself, then those beside it; a component of 0 stays: beside it are only subnormal numbers."""
        origin, direction = ([self.rounding(x) for x in v] for v in (given.origin, given.direction))
        start = self.rounding(given.start)
        yield origin, direction, start
        for vector in (origin, direction):
            x = vector[0]
            if x == 0:
                continue
            for sign in (1, -1):
                vector[0] = self.next(x, sign)
                yield list(origin), list(direction), start
            vector[0] = x


NARROW = Width("narrow", narrow, 24, "ABC")
WIDE = Width("wide", wide, 53, "D")


def open_at(tier, margin, band):
    """Whether hit or miss is left open; margins are worked out in double, so that the last bits are not theirs."""
    return tier == "A" or abs(margin) <= band + 1e-13


class Expected:
    """What one ray owes. t: None for a miss. object: its index; None: any. bounds: what t may be off at each of the
    width's tiers; is_open: whether hit or miss is left open there."""

    def __init__(self, t, index, is_open, bounds):
        self.t, self.object, self.is_open, self.bounds = t, index, is_open, bounds

    def text(self):
        """A row of the C table."""
        bits = sum(1 << place for place, is_open in enumerate(self.is_open) if is_open)
        if self.t is None:
            return f"{{0, 0, {MISS}, {bits}, {{0}}}}"
        middle = exact.fraction(self.t)
        high = float(middle)
        low = float(middle - exact.Fraction(high))
        limits = ", ".join("INFINITY" if b == inf else f"{b:.3g}" for b in self.bounds)
        name = ANY if self.object is None else str(self.object)
        return f"{{{high.hex()}, {low:.3g}, {name}, {bits}, {{{limits}}}}}"


def expected(shapes, ray, width, given, ulps, must):
    found = [(hit, i) for i, hit in enumerate(shape.hit(ray) for shape in shapes) if hit is not None]
    t, index = min(found) if found else (None, None)
    # of a miss: the shape that is missed by the least decides
    margins = [shape.margin(ray) for shape in shapes]
    nearest = index if found else max(range(len(shapes)), key=lambda i: margins[i])
    shape, margin = shapes[nearest], margins[nearest]
    rho = max(shape.distance(ray) / shape.radius, 1.0) if shape.radius else 1.0
    is_open, bounds = [], []
    touch = t is None and given is not None and given.expect is not None
    if touch:
        t, index = exact.rational(given.expect), 0
    for tier in width.tiers:
        band = 16 * width.u if tier in "CD" or isinstance(shape, exact.Triangle) else 4 * width.u * rho
        is_open.append(tier not in must and open_at(tier, margin, band))
        bounds.append(0.0 if t is None else bound(shape, ray, t, width, tier, given, ulps, touch))
    if t is None:
        return Expected(None, None, is_open, bounds)
    if len(shapes) > 1:
        # an edge that triangles share is hit on any of them
        sharing = [triangle for triangle in shapes if is_close(triangle, ray, width)]
        for place, tier in enumerate(width.tiers):
            bounds[place] = max([bounds[place]] + [bound(s, ray, t, width, tier, given, ulps, touch) for s in sharing])
        if is_unsettled(shapes, ray, t, width):
            bounds = [inf] * len(bounds)
    return Expected(t, None if len(shapes) > 1 else index, is_open, bounds)


def is_close(triangle, ray, width):
    return triangle.margin(ray) <= 16 * width.u + 1e-13


def is_unsettled(triangles, ray, t, width):
    """Whether rounding may tell another distance. A triangle with an edge within 16 u of the ray may be hit or not; so
    what counts is where those are crossed, up to the first that is hit for certain."""
    doubtful, certain = [], []
    for triangle in triangles:
        if is_close(triangle, ray, width):
            doubtful += exact.Plane.crossings(triangle, ray)
        else:
            certain += triangle.crossings(ray)
    ends = [crossing for crossing in certain if crossing > ray.start]
    last = [min(ends)] if ends else []
    doubtful = [crossing for crossing in doubtful if crossing > ray.start and all(crossing < end for end in last)]
    return any(abs(crossing - t) > t * 16 * exact.rational(width.u) for crossing in doubtful + last)


def bound(shape, ray, t, width, tier, given, ulps, touch):
    """What t may be off, in t's own unit."""
    if given is not None and tier in given.within:
        return given.within[tier]
    if given is not None and tier in given.ulps:
        return given.ulps[tier] * width.ulp(float(exact.fraction(t)))
    if tier == "A":
        return inf
    unit = width.ulp(float(exact.fraction(t)))
    if touch:
        return inf
    cosine = max(shape.cosine(ray, t), 1e-30)
    if tier == "B":
        slack = 16 * width.u * (shape.distance(ray) + shape.size) if cosine < 0.1 else 0.0
        return ulps.get(tier, 8) * unit + slack / cosine / ray.scale
    return ulps.get(tier, 4) * unit + 4 * width.u * (shape.size or shape.distance(ray)) / cosine / ray.scale


ROOM = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]


def triangle_room():
    """The cube's faces, two triangles each; corner i has the signs of its bits."""
    corners = [[1.0 if i >> axis & 1 else -1.0 for axis in range(3)] for i in range(8)]
    return [[corners[i] for i in pick] for a, b, c, d in ROOM for pick in ((a, b, c), (a, c, d))]


MESHES = {"icosphere": families.icosphere, "room": triangle_room}


class MeshOracle:
    """The triangles of a mesh; a ray is held against those exactly that it comes as near to as they are large."""

    def __init__(self, corners, rounding):
        self.shapes = [exact.Triangle(*([rounding(x) for x in vertex] for vertex in triangle)) for triangle in corners]
        self.spheres = []
        for shape in self.shapes:
            center = [sum(exact.floats(v)[k] for v in shape.vertices) / 3 for k in range(3)]
            self.spheres.append((*center, shape.size**2))

    def near(self, origin, direction):
        ox, oy, oz = origin
        dx, dy, dz = direction
        dd = dx * dx + dy * dy + dz * dz
        found = []
        for shape, (x, y, z, squared) in zip(self.shapes, self.spheres):
            x, y, z = x - ox, y - oy, z - oz
            along = x * dx + y * dy + z * dz
            if x * x + y * y + z * z - along * along / dd <= squared and along >= -dd:
                found.append(shape)
        return found


def answers(set_, width):
    """(origin, direction, start, Expected) of each ray that is held to exact answers."""
    if set_.family is None:
        shapes = [make(width.rounding) for _, make in set_.objects]
        for given in set_.rays:
            for i, numbers in enumerate(width.neighbors(given)):
                must = given.must if i == 0 else ""
                yield *numbers, expected(shapes, exact.Ray(*numbers), width, given, set_.ulps, must)
        return
    mesh = MESHES[set_.objects]() if isinstance(set_.objects, str) else None
    oracle = MeshOracle(mesh, width.rounding) if mesh else None
    if not mesh:
        shapes = [make(width.rounding) for _, make in set_.objects]
    make_ray = getattr(families, set_.family)
    for i in range(MESH_SAMPLE if mesh else SAMPLE):
        origin, direction = make_ray(mesh, i) if set_.family == "from_within" else make_ray(i)
        origin, direction = [width.rounding(x) for x in origin], [width.rounding(x) for x in direction]
        if mesh:
            shapes = oracle.near(origin, direction)
        yield origin, direction, 0.0, expected(shapes, exact.Ray(origin, direction), width, None, set_.ulps, set_.must)


def plain(number):
    return repr(float(number)).removesuffix(".0")


def write(out):
    out.write("// Written by tests/oracle/write_tables.py; do not edit.\n")
    out.write('#include "host/verify/tables.h"\n\n#include <math.h>\n\n// clang-format off\n')
    rows = []
    for number, set_ in enumerate(SETS):
        name = f"{set_.case.lower()}_{number}"
        scene, rays, family, ray_count = "NULL", "NULL", "NULL", str(set_.count)
        if set_.scene is None:
            lines = "".join(f'\n    "  - {text}\\n"' for text, _ in set_.objects)
            out.write(f'static const char {name}_scene[] = "objects:\\n"{lines};\n')
            scene = f"{name}_scene"
        if set_.family is None:
            out.write(f"static const PlainRay {name}_rays[] = {{\n")
            for ray in set_.rays:
                o, d = (", ".join(map(plain, v)) for v in (ray.origin, ray.direction))
                out.write(f"    {{{{{o}}}, {{{d}}}, {plain(ray.start)}}},\n")
            out.write("};\n")
            rays, ray_count = f"{name}_rays", str(len(set_.rays))
        else:
            family = f"family_{set_.family}"
        counts = []
        for width in (NARROW, WIDE):
            lines = [row.text() for *_, row in answers(set_, width)]
            counts.append(len(lines))
            out.write(f"static const Expected {name}_{width.name}[] = {{\n")
            out.write("".join(f"    {line},\n" for line in lines))
            out.write("};\n")
        leaks = "true" if set_.limits.get("leaks") else "false"
        rows.append(
            f'    {{"{set_.case}", {scene}, {"scene_" + set_.scene if set_.scene else "NULL"}, {rays}, {family}, '
            f"{ray_count}, {{{name}_narrow, {name}_wide}}, {{{counts[0]}, {counts[1]}}}, {leaks}}},\n"
        )
        print(name, file=sys.stderr)
    out.write("\nconst ProbeTable probe_tables[] = {\n" + "".join(rows) + "};\n")
    out.write("const size_t probe_table_count = sizeof probe_tables / sizeof *probe_tables;\n")


if __name__ == "__main__":
    write(sys.stdout)
