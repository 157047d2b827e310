"""The probe cases: scenes, rays, and what the answers owe at each tier.

Tiers are those of the precisions: A fast, B single, C strict, D double. A number is decimal, rounded once to the
precision; from then on everything is exact. Each given ray is also taken with its origin's and its direction's x one
unit in the last place up and down."""

from math import sqrt

import exact
import families


class Given:
    """A ray by its numbers. must: the tiers at which hit or miss is not open, however near the boundary. ulps, within:
    what t may be off at a tier, in place of the conventions. expect: t where the oracle sees no crossing, a touch."""

    def __init__(self, origin, direction, start=0.0, must="", ulps=None, within=None, expect=None):
        self.origin, self.direction, self.start = origin, direction, start
        self.must, self.ulps, self.within, self.expect = must, ulps or {}, within or {}, expect


class Set:
    """Rays of one case at one scene. objects: (YAML, shape of rounded numbers) of each, or the name of a mesh."""

    def __init__(self, case, objects, rays=(), family=None, count=0, ulps=None, scene=None, must="", **limits):
        self.case, self.objects, self.rays, self.family, self.count = case, objects, rays, family, count
        self.ulps, self.scene, self.must, self.limits = ulps or {}, scene, must, limits


def numbers(values):
    return "[" + ", ".join(repr(float(x)) for x in values) + "]"


def sphere(center, radius):
    text = f"sphere: {{center: {numbers(center)}, radius: {radius!r}}}"
    return text, lambda r: exact.Sphere(map(r, center), r(radius))


def plane(point, normal):
    text = f"plane: {{point: {numbers(point)}, normal: {numbers(normal)}}}"
    return text, lambda r: exact.Plane(map(r, point), map(r, normal))


def disc(center, normal, radius):
    text = f"disc: {{center: {numbers(center)}, normal: {numbers(normal)}, radius: {radius!r}}}"
    return text, lambda r: exact.Disc(map(r, center), map(r, normal), r(radius))


def box(low, high):
    text = f"box: {{min: {numbers(low)}, max: {numbers(high)}}}"
    return text, lambda r: exact.Box(map(r, low), map(r, high))


def cylinder(start, end, radius):
    text = f"cylinder: {{from: {numbers(start)}, to: {numbers(end)}, radius: {radius!r}}}"
    return text, lambda r: revolution(r, start, end, [radius, radius])


def endless_cylinder(point, axis, radius):
    text = f"cylinder: {{point: {numbers(point)}, axis: {numbers(axis)}, radius: {radius!r}}}"
    return text, lambda r: exact.Revolution(map(r, point), map(r, axis), [r(radius)] * 2, infinite=True)


def cone(start, end, radii):
    text = f"cone: {{from: {numbers(start)}, to: {numbers(end)}, radius: {numbers(radii)}}}"
    return text, lambda r: revolution(r, start, end, radii)


def revolution(r, start, end, radii):
    base = [r(x) for x in start]
    axis = exact.subtract(exact.vector(r(x) for x in end), exact.vector(base))
    return exact.Revolution(base, [exact.fraction(x) for x in axis], [r(x) for x in radii])


def torus(center, major, minor):
    text = f"torus: {{center: {numbers(center)}, axis: [0, 0, 1], major: {major!r}, minor: {minor!r}}}"
    return text, lambda r: exact.Torus(map(r, center), r(major), r(minor))


def triangle(a, b, c):
    text = f"triangle: {{vertices: [{numbers(a)}, {numbers(b)}, {numbers(c)}]}}"
    return text, lambda r: exact.Triangle(map(r, a), map(r, b), map(r, c))


X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
UNIT = sphere((0, 0, 0), 1.0)
CUBE = box((-1, -1, -1), (1, 1, 1))
RING = torus((0, 0, 0), 1.0, 0.25)
BOTH = {"B": 4, "C": 4, "D": 4}
TIGHT = {"B": 4, "C": 2, "D": 2}

SETS = [
    Set("S1", [UNIT], [Given((0.6, 0, -L), Z, within={"A": 0.4}, ulps=TIGHT, must="ABCD") for L in (100, 1e3, 4096, 1e4, 1e5, 1e6)]),
    Set("S3", [sphere((0.3, 0.2, 5), 1e-4)], [Given((0, 0, 0), families.unit([0.3 + k, 0.2, 5.0])) for k in (0, 5e-5, 9e-5, 9.9e-5, 1.01e-4)]),
    Set("S4", [sphere((0, -1e6, 0), 1e6)], [
        Given((0, 1, 0), (sqrt(1 - y * y), y, 0), within={"B": 0.25 / -y}, ulps={"C": 8, "D": 8} if y <= -0.01 else {"C": 16, "D": 16})
        for y in (-1, -0.5, -0.1, -0.01, -0.002, -0.00142, -0.00141)
    ]),
    Set("S5", [UNIT], [
        Given((1 - 2**-20, 0, -5), Z, must="BCD", ulps={"B": 16}),
        Given((1 - 2**-24, 0, -5), Z, must="CD"),
        Given((1, 0, -5), Z),
        Given((1 + 2**-23, 0, -5), Z, must="CD"),
    ]),
    Set("S6", [UNIT], [Given((0.5, 0, 0), X), Given((0.999999, 0, 0), X), Given((0.999999, 0, 0), Y)]),
    Set("P1", [plane((0, 0, 0), Y)],
        [Given((0, 1.7, 0), (0, -(2.0**-k), 1), must="ABCD", ulps=BOTH) for k in (1, 10, 16, 20, 23)]
        + [Given((0, 1.7, 0), (0, y, 1), must="ABCD") for y in (2.0**-1, 2.0**-10, 2.0**-16, 2.0**-20, 2.0**-23, 0.0, -0.0)]),
    Set("P3", [disc((10, 20, 30), (1, 1, 1), 2.0)], family="disc_rim", count=100000),
    Set("P3", [disc((10, 20, 30), (1, 1, 1), 2.0)], [Given((5, 20, 35), (1, -1, 0)), Given((12, 18, 30), (-1, 1, 0)), Given((10, 15, 35), (0, 1, -1))]),
    Set("P4", [CUBE], [
        Given((x, y, -5), (zero, zero, 1), must="ABCD", ulps={"A": 0, "B": 0, "C": 0, "D": 0})
        for zero in (0.0, -0.0)
        for x, y in ((1, 0), (-1, 0), (1, 1), (-1, -1), (0, 0), (1 + 2**-23, 0))
    ] + [Given((1, 0, 0), (zero, zero, 1), must="ABCD", ulps={"A": 0, "B": 0, "C": 0, "D": 0}) for zero in (0.0, -0.0)]),
    Set("P5", [CUBE], family="in_room", count=1000000, must="ABCD", leaks=True),
    Set("P5", "room", family="in_room", count=1000000, must="ABCD", scene="triangle_room", leaks=True),
    Set("P6", [box((0, 0, 0), (1, 1, 1e-6))], [
        Given((0.5, 0.5, 10), d, start, must="ABCD")
        for d in ((0, 0, -1), (0.01, 0.02, -1)) for start in (0, 9.9999995)
    ]),
    Set("C1", [endless_cylinder((0, 0, 0), Z, 1.0)], [Given((x, 0, -3), Z, must="ABCD") for x in (0.5, 2)] + [Given((1, 0, -3), Z)]),
    Set("C1", [cylinder((0, 0, 0), (0, 0, 2), 1.0)],
        [Given((x, 0, -3), Z, start, must="ABCD", ulps={"B": 0, "C": 0, "D": 0}) for x in (0.5, 2) for start in (0, 4)]
        + [Given((1, 0, -3), Z)]),
    Set("C2", [endless_cylinder((0, 0, 0), Z, 1.0)],
        [Given((x, 0, 0), (2.0**-j, 0, 1), must="ABCD", ulps=BOTH) for x in (0, 0.25) for j in (10, 12, 16, 20)]),
    Set("C3", [cylinder((-1e4, 0, 0), (1e4, 0, 0), 1e-3)], [Given((0, 5e-4, -10), Z, must="BCD")]),
    Set("C4", [cylinder((5, 5, 5), (5 + 2 / 3, 5 + 4 / 3, 5 + 4 / 3), 1.0)], family="cylinder_rim", count=1000000, must="ABCD", leaks=True),
    Set("C5", [endless_cylinder((0, 0, 0), Z, 1.0)], [
        Given((-L, b, 0), X, must="BCD") for L in (1e3, 1e5) for b in (0.5, 0.99, 0.99999, 1.00001)
    ]),
    Set("C6", [cone((0, 0, 0), (0, 0, 10), (0, 5))], [
        Given((5, 0, 0), (-1, 0, 0)),
        Given((5, 0, 2**-20), (-1, 0, 0), must="BCD"),
        Given((5, 0, -(2**-20)), (-1, 0, 0), must="BCD"),
        Given((0, 0, -5), Z, must="BCD"),
        Given((5, 2**-20, 2**-20), (-1, 0, 0), must="BCD"),
    ]),
    Set("C7", [cone((0, 0, 0), (0, 0, 10), (0, 10))], [
        Given((3, 0.5, 1), (-1, 0, z), must="BCD", ulps=BOTH) for z in (1, 1 + 2**-23, 1 - 2**-24)
    ]),
    Set("C7", [cone((0, 0, 0), (0, 0, 10), (0, 5))], [
        Given((5, 0, -2), (-1, 0, 0), must="ABCD"), Given((5, 0, 2), (-1, 0, 0), must="ABCD", ulps=BOTH),
    ]),
    Set("T1", [RING], [Given((0.9, 0, -1000), Z, must="BCD"), Given((300, 400, -866), families.unit([-299.1, -399.7, 866.1]), must="BCD")]),
    Set("T2", [RING], [Given((x, 0, 10), (0, 0, -1), must="BCD") for x in (0, 0.74, 0.76)] + [Given((0.75, 0, 10), (0, 0, -1))]),
    Set("T2", [RING], family="along_torus_axis", count=10000),
    Set("T3", [RING], [Given((x, y, 0), X) for x, y in ((-5, 0), (-1, 0), (0, 0), (-5, 0.75), (-5, 1.25), (-5, 1))]
        + [Given((-5, 0, 0), X, start) for start in (4, 5, 6)]),
    Set("T3", [RING], family="across_torus", count=10000),
    Set("T4", [RING], [
        Given((-5, 0, z), X, must="BCD", within={t: 4e-4 for t in "BCD"}, expect=4) for z in (0.25, 0.25 - 2**-26)
    ] + [Given((-5, 0, 0.25 + 2**-25), X)]),
    Set("T5", [torus((0, 0, 0), 1.0, 1e-3)], [Given((x, 0, -10), Z) for x in (1.0005, 1.0009, 1.0011)]),
    Set("T6", [torus((0, 0, 0), 143.0, 113.2)], [
        Given((160.371250, -6.351337, -0.000241), (0.852793, -0.522249, -0.000020), must="BCD", ulps={"B": 16, "C": 16}, within={"D": 1e-12})
    ]),
    Set("M1", "icosphere", family="from_within", count=1000000, must="ABCD", scene="icosphere", leaks=True),
    Set("M3", [triangle((0, 0, 0), (2e-4, 0, 0), (0, 2e-4, 0))], [Given((2e-4 / 3, 2e-4 / 3, -1), Z, must="ABCD")]),
    Set("M4", [triangle((0, 0, 0), (1, 0, 0), (0.5, 1e-6, 0))], [Given((0.5, 3e-7, z), (0, 0, -1)) for z in (1, 1e3)]),
    Set("M4", [triangle(*families.SLIVER)], family="beside_sliver", count=100000),
    Set("M5", [triangle((-1113.45459, -79.049614, -56.2431908), (-1113.45459, -87.0922699, -56.2431908), (-1113.45459, -79.2090149, -56.2431908))],
        [Given((-1081.47925, 99.9999542, 87.7701111), (-32.1072998, -183.355865, -144.607635), must="ABCD")]),
]  # fmt: skip
