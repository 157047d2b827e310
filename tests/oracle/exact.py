"""Computes closest hits in exact rationals, certified roots and 300-bit balls. Nothing here cancels, so that every formula is
that of the textbook.

A solid is a set of points with an exact membership test and, for a line, the t where it may begin or end. These are
sorted, the membership of a rational point between each two says whether that interval is inside, and the crossings are
where that changes. Surfaces without an inside (plane, disc, triangle) have one crossing at most.
"""

from fractions import Fraction
from math import sqrt

from flint import arb, ctx, fmpq, fmpq_poly

ctx.prec = 300
SAME = fmpq(1, 2**200)  # values of t nearer than this are one: far below what roots of such small numbers can differ by


def rational(number):
    if isinstance(number, fmpq):
        return number
    exact = Fraction(number)
    return fmpq(exact.numerator, exact.denominator)


def fraction(number):
    """Returns an fmpq, or the middle of a ball, as a Fraction."""
    if isinstance(number, arb):
        mantissa, exponent = number.mid().man_exp()
        return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
    return Fraction(int(number.p), int(number.q))


def middle(number):
    exact = fraction(number)
    return fmpq(exact.numerator, exact.denominator)


def vector(numbers):
    return [rational(number) for number in numbers]


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def subtract(a, b):
    return [a[0] - b[0], a[1] - b[1], a[2] - b[2]]


def floats(a):
    return [float(fraction(x)) for x in a]


def length(a):
    return sqrt(float(fraction(dot(a, a))))


def off_axis_squared(p, axis):
    return dot(p, p) - dot(p, axis) ** 2 / dot(axis, axis)


class Ray:
    def __init__(self, origin, direction, start=0):
        self.origin, self.direction, self.start = vector(origin), vector(direction), rational(start)
        self.scale = length(self.direction)

    def at(self, t):
        return [o + t * d for o, d in zip(self.origin, self.direction)]

    def polynomials(self, base, axis):
        """Returns |p|^2 and p . axis as polynomials in t, where p is the ray's point seen from the base."""
        f, d = subtract(self.origin, base), self.direction
        return fmpq_poly([dot(f, f), 2 * dot(f, d), dot(d, d)]), fmpq_poly([dot(f, axis), dot(d, axis)])


def polynomial_roots(coefficients):
    """Returns real roots of a polynomial with rational coefficients, constant first, as 300-bit rationals."""
    poly = fmpq_poly(coefficients)
    if poly.degree() < 1:
        return []
    return [middle(root.real) for root, _ in poly.numer().complex_roots() if root.imag == 0]


class Shape:
    """center, size: for tolerances; radius: of the cross-section whose silhouette a ray may graze."""

    def crossings(self, ray):
        """Returns t of each crossing of a line, ascending."""
        ts = []
        for t in sorted(self.boundary_ts(ray)):
            if not ts or t - ts[-1] > SAME:
                ts.append(t)
        if not ts:
            return []
        between = [ts[0] - 1] + [(a + b) / 2 for a, b in zip(ts, ts[1:])] + [ts[-1] + 1]
        inside = [self.contains(ray.at(t)) for t in between]
        return [t for i, t in enumerate(ts) if inside[i] != inside[i + 1]]

    def hit(self, ray):
        """Returns the first t beyond the ray's start, or None."""
        return next((t for t in self.crossings(ray) if t > ray.start), None)

    def cosine(self, ray, t):
        normal = self.normal(ray.at(t))
        return abs(float(fraction(dot(normal, ray.direction)))) / max(length(normal) * ray.scale, 1e-300)

    def distance(self, ray):
        return length(subtract(ray.origin, self.center))


class Sphere(Shape):
    def __init__(self, center, radius):
        self.center, self.radius_squared = vector(center), rational(radius) ** 2
        self.radius = self.size = float(fraction(rational(radius)))

    def boundary_ts(self, ray):
        f = subtract(ray.origin, self.center)
        d = ray.direction
        return polynomial_roots([dot(f, f) - self.radius_squared, 2 * dot(f, d), dot(d, d)])

    def contains(self, point):
        p = subtract(point, self.center)
        return dot(p, p) <= self.radius_squared

    def normal(self, point):
        return subtract(point, self.center)


class Box(Shape):
    def __init__(self, low, high):
        self.low, self.high = vector(low), vector(high)
        self.center = [(a + b) / 2 for a, b in zip(self.low, self.high)]
        self.half = floats([(b - a) / 2 for a, b in zip(self.low, self.high)])
        self.size = self.radius = sqrt(sum(x * x for x in self.half))

    def boundary_ts(self, ray):
        return [
            (face - o) / d
            for low, high, o, d in zip(self.low, self.high, ray.origin, ray.direction)
            if d != 0
            for face in (low, high)
        ]

    def contains(self, point):
        return all(a <= x <= b for a, x, b in zip(self.low, point, self.high))

    def normal(self, point):
        faces = [min(abs(x - a), abs(x - b)) for a, x, b in zip(self.low, point, self.high)]
        return [rational(int(face == min(faces))) for face in faces]

    def cosine(self, ray, t):
        # at an edge any of the faces that meet there may be reported, so take the one crossed most steeply
        faces = [min(abs(x - a), abs(x - b)) for a, x, b in zip(self.low, ray.at(t), self.high)]
        return max(abs(float(fraction(d))) for d, face in zip(ray.direction, faces) if face == min(faces)) / ray.scale


class Revolution(Shape):
    """A cylinder or cone from one point to another, or an infinite cylinder along `axis`. Without caps it is the part of
    an infinite solid's surface between its ends."""

    def __init__(self, base, axis, radii, infinite=False, caps=True):
        self.base, self.axis = vector(base), vector(axis)
        self.radii, self.infinite, self.caps = [rational(r) for r in radii], infinite, caps
        self.axis_squared = dot(self.axis, self.axis)
        self.axis_length = length(self.axis)
        self.center = self.base if infinite else [b + a / 2 for b, a in zip(self.base, self.axis)]
        self.radius = float(max(map(fraction, self.radii)))
        self.size = self.radius if infinite else sqrt(self.radius**2 + self.axis_length**2 / 4)

    def boundary_ts(self, ray):
        # (|p|^2 - h^2 / |w|^2) = (r + (R - r) h / |w|^2)^2 with h = p . w, times |w|^4
        ww = self.axis_squared
        p_p, height = ray.polynomials(self.base, self.axis)
        radius = self.radii[0] * ww + (self.radii[1] - self.radii[0]) * height
        side = p_p * ww**2 - height * height * ww - radius * radius
        found = polynomial_roots(side.coeffs())
        if self.has_ends() and height[1] != 0:
            found += [(end - height[0]) / height[1] for end in (fmpq(0), ww)]
        return found

    def has_ends(self):
        return self.caps and not self.infinite

    def crossings(self, ray):
        found = super().crossings(ray)
        if self.caps or self.infinite:
            return found
        return [t for t in found if 0 <= dot(subtract(ray.at(t), self.base), self.axis) <= self.axis_squared]

    def contains(self, point):
        p = subtract(point, self.base)
        height = dot(p, self.axis)
        if self.has_ends() and not 0 <= height <= self.axis_squared:
            return False
        radius = self.radii[0] * self.axis_squared + (self.radii[1] - self.radii[0]) * height
        return radius >= 0 and (dot(p, p) * self.axis_squared - height**2) * self.axis_squared <= radius**2

    def normal(self, point):
        p = subtract(point, self.base)
        height = dot(p, self.axis) / self.axis_squared
        if self.has_ends() and min(abs(height), abs(height - 1)) < SAME:
            return self.axis
        across = [x - height * a for x, a in zip(p, self.axis)]
        radius = self.radii[0] + (self.radii[1] - self.radii[0]) * height
        lean = radius * (self.radii[1] - self.radii[0]) / self.axis_squared
        normal = [x - lean * a for x, a in zip(across, self.axis)]
        return normal if any(normal) else self.axis


class DoubleCone(Shape):
    """Both nappes of an infinite cone. slope: radius over height. apart: how far the nappes' tips are from the apex
    along the axis, in lengths of the axis; below 0 they overlap."""

    def __init__(self, apex, axis, slope, apart=0):
        self.center, self.axis, self.slope, self.apart = vector(apex), vector(axis), rational(slope), rational(apart)
        self.axis_squared = dot(self.axis, self.axis)
        self.radius = self.size = 0.0

    def tips(self):
        """Returns (tip, axis) of each nappe."""
        for sign in (1, -1):
            yield [c + sign * self.apart * a for c, a in zip(self.center, self.axis)], [sign * a for a in self.axis]

    def boundary_ts(self, ray):
        # |p|^2 |w|^2 - h^2 = slope^2 h^2 with h = p . w
        found = []
        for tip, w in self.tips():
            p_p, height = ray.polynomials(tip, w)
            found += polynomial_roots((p_p * self.axis_squared - height * height * (1 + self.slope**2)).coeffs())
        return found

    def contains(self, point):
        for tip, w in self.tips():
            p = subtract(point, tip)
            height = dot(p, w)
            if height >= 0 and dot(p, p) * self.axis_squared <= (1 + self.slope**2) * height**2:
                return True
        return False

    def normal(self, point):
        p = subtract(point, self.center)
        height = dot(p, self.axis) / self.axis_squared
        return [x - height * (1 + self.slope**2) * a for x, a in zip(p, self.axis)]


class Torus(Shape):
    def __init__(self, center, major, minor, axis=(0, 0, 1)):
        self.center, self.major, self.minor = vector(center), rational(major), rational(minor)
        self.axis = vector(axis)
        self.axis_squared = dot(self.axis, self.axis)
        self.radius, self.major_radius = floats([self.minor, self.major])
        self.size = self.major_radius + self.radius

    def boundary_ts(self, ray):
        # (|p|^2 + R^2 - r^2)^2 = 4 R^2 (|p|^2 - h^2 / |w|^2) with h = p . w
        p_p, height = ray.polynomials(self.center, self.axis)
        sum_ = p_p + (self.major**2 - self.minor**2)
        flat = p_p - height * height / self.axis_squared
        return polynomial_roots((sum_ * sum_ - 4 * self.major**2 * flat).coeffs())

    def contains(self, point):
        # the sum is below 0 only where the tube of a spindle, minor > major, reaches beyond the axis
        p = subtract(point, self.center)
        sum_ = dot(p, p) + self.major**2 - self.minor**2
        return sum_ <= 0 or sum_**2 <= 4 * self.major**2 * off_axis_squared(p, self.axis)

    def normal(self, point):
        p = subtract(point, self.center)
        across = middle(arb(off_axis_squared(p, self.axis)).sqrt())
        if across == 0:
            return p
        height = dot(p, self.axis) / self.axis_squared
        return [x - self.major / across * (x - height * a) for x, a in zip(p, self.axis)]


class Paraboloid(Shape):
    """The points whose squared distance from the axis is at most 4 f times the height above the apex. Ends and caps are
    optional, as in Revolution. The axis' length is rounded to 300 bits."""

    def __init__(self, apex, axis, focal_length, height, infinite=False, caps=True):
        self.center, self.axis, self.focal_length = vector(apex), vector(axis), rational(focal_length)
        self.axis_squared = dot(self.axis, self.axis)
        self.unit = middle(arb(self.axis_squared).sqrt())
        self.end, self.infinite, self.caps = rational(height) * self.unit, infinite, caps
        f, end = floats([self.focal_length, rational(height)])
        self.radius = self.size = 2 * (end if infinite else sqrt(f * end) + end)
        self.least = 2 * f if infinite else min(2 * f, end)  # of the apex' radius of curvature and the height

    def boundary_ts(self, ray):
        # |p|^2 - h^2 / |w|^2 = 4 f h / |w| with h = p . w
        p_p, height = ray.polynomials(self.center, self.axis)
        found = polynomial_roots((p_p - height * height / self.axis_squared - 4 * self.focal_length / self.unit * height).coeffs())
        if self.has_end() and height[1] != 0:
            found.append((self.end - height[0]) / height[1])
        return found

    def has_end(self):
        return self.caps and not self.infinite

    def crossings(self, ray):
        found = super().crossings(ray)
        if self.caps or self.infinite:
            return found
        return [t for t in found if dot(subtract(ray.at(t), self.center), self.axis) <= self.end]

    def contains(self, point):
        p = subtract(point, self.center)
        height = dot(p, self.axis)
        if self.has_end() and height > self.end:
            return False
        return off_axis_squared(p, self.axis) <= 4 * self.focal_length / self.unit * height

    def normal(self, point):
        p = subtract(point, self.center)
        height = dot(p, self.axis)
        if self.has_end() and abs(height - self.end) < SAME:
            return self.axis
        lean = (height / self.unit + 2 * self.focal_length) / self.unit
        return [x - lean * a for x, a in zip(p, self.axis)]


class Superellipsoid(Shape):
    """The points center + x axes[0] + y axes[1] + z axes[2] with x^n + y^n + z^n <= 1 for the even exponent n."""

    def __init__(self, center, axes, exponent):
        self.center, self.axes, self.exponent = vector(center), [vector(axis) for axis in axes], int(exponent)
        a, b, c = self.axes
        volume = dot(a, cross(b, c))
        self.rows = [[x / volume for x in row] for row in (cross(b, c), cross(c, a), cross(a, b))]
        self.radius, self.size = min(map(length, self.axes)), sqrt(sum(length(axis) ** 2 for axis in self.axes))

    def boundary_ts(self, ray):
        f = subtract(ray.origin, self.center)
        parts = [fmpq_poly([dot(row, f), dot(row, ray.direction)]) ** self.exponent for row in self.rows]
        return polynomial_roots((parts[0] + parts[1] + parts[2] - 1).coeffs())

    def contains(self, point):
        p = subtract(point, self.center)
        return sum(dot(row, p) ** self.exponent for row in self.rows) <= 1

    def normal(self, point):
        p = subtract(point, self.center)
        powers = [dot(row, p) ** (self.exponent - 1) for row in self.rows]
        return [sum(power * row[i] for power, row in zip(powers, self.rows)) for i in range(3)]


class Plane(Shape):
    def __init__(self, point, normal):
        self.center, self.direction = vector(point), vector(normal)
        self.size = self.radius = 0.0

    def crossings(self, ray):
        along = dot(self.direction, ray.direction)
        return [] if along == 0 else [dot(self.direction, subtract(self.center, ray.origin)) / along]

    def normal(self, point):
        return self.direction


class Disc(Plane):
    def __init__(self, center, normal, radius):
        super().__init__(center, normal)
        self.radius_squared = rational(radius) ** 2
        self.size = self.radius = float(radius)

    def off(self, ray, t):
        v = subtract(ray.at(t), self.center)
        return dot(v, v)

    def crossings(self, ray):
        return [t for t in super().crossings(ray) if self.off(ray, t) <= self.radius_squared]


class Triangle(Plane):
    def __init__(self, a, b, c):
        self.vertices = [vector(a), vector(b), vector(c)]
        self.center = self.vertices[0]
        self.sides = [subtract(self.vertices[(i + 1) % 3], self.vertices[i]) for i in range(3)]
        self.direction = cross(self.sides[0], self.sides[1])
        self.size = self.radius = max(map(length, self.sides))

    def edges(self, ray):
        """Returns six times the volume that each edge spans with the ray."""
        seen = [subtract(v, ray.origin) for v in self.vertices]
        return [dot(ray.direction, cross(seen[i], seen[(i + 1) % 3])) for i in range(3)]

    def crossings(self, ray):
        edges = self.edges(ray)
        return [] if min(edges) < 0 < max(edges) else super().crossings(ray)


def grown(shape, by):
    """Returns the solid with its surface moved outward by so much, or inward below 0."""
    if isinstance(shape, Sphere):
        return Sphere(shape.center, Fraction(shape.radius) + Fraction(by))
    if isinstance(shape, Box):
        return Box([x - rational(by) for x in shape.low], [x + rational(by) for x in shape.high])
    if isinstance(shape, Torus):
        return Torus(shape.center, shape.major, shape.minor + rational(by), shape.axis)
    if isinstance(shape, DoubleCone):
        slope = float(fraction(shape.slope))
        sine = slope / sqrt(1 + slope**2)
        return DoubleCone(shape.center, shape.axis, shape.slope, -by / sine / length(shape.axis))
    if isinstance(shape, Superellipsoid):
        longer = [[x * (1 + rational(by / length(axis))) for x in axis] for axis in shape.axes]
        return Superellipsoid(shape.center, longer, shape.exponent)
    if isinstance(shape, Paraboloid):
        # with its apex moved by s and its focal length f by g, the surface at height z moves by (f s + z g) /
        # sqrt(f (f + z)): by as much at the apex and the rim, and by less between; an infinite one at its apex
        height = shape.end / shape.unit
        f, z = floats([shape.focal_length, height])
        wider = 0 if shape.infinite else by * (sqrt(f * (f + z)) - f) / z
        apex = [c - rational(by) / shape.unit * a for c, a in zip(shape.center, shape.axis)]
        focal_length = shape.focal_length + rational(wider)
        return Paraboloid(apex, shape.axis, focal_length, height + 2 * rational(by), shape.infinite, shape.caps)
    ends = rational(by / shape.axis_length)
    slope = (shape.radii[1] - shape.radii[0]) / rational(shape.axis_length)
    wider = rational(by * sqrt(1 + float(fraction(slope)) ** 2))
    radii = [shape.radii[0] + wider - slope * rational(by), shape.radii[1] + wider + slope * rational(by)]
    base = [b - ends * a for b, a in zip(shape.base, shape.axis)]
    return Revolution(base, [a * (1 + 2 * ends) for a in shape.axis], radii, shape.infinite, shape.caps)


def shape_of(given):
    """Returns a shape by its numbers and flags, as answers.c prints them. The numbers are the doubles that its member of
    Object.as (host/scene/scene.h) begins with, in their order there."""
    kind, n = given["shape"], given["numbers"]
    if kind == "sphere":
        return Sphere(n[:3], n[3])
    if kind == "plane":
        return Plane(n[:3], n[3:6])
    if kind == "disc":
        return Disc(n[:3], n[3:6], n[6])
    if kind == "box":
        return Box(n[:3], n[3:6])
    if kind == "cylinder":
        return Revolution(n[:3], n[3:6], [n[6]] * 2, not given["finite"], given["caps"])
    if kind == "cone" and given["finite"]:
        return Revolution(n[:3], n[3:6], n[6:8], caps=given["caps"])
    if kind == "cone":
        return DoubleCone(n[:3], n[3:6], n[8])
    if kind == "paraboloid":
        return Paraboloid(n[:3], n[3:6], n[6], n[7], not given["finite"], given["caps"])
    if kind == "superellipsoid":
        return Superellipsoid(n[:3], [n[3:6], n[6:9], n[9:12]], n[12])
    if kind == "triangle":
        return Triangle(n[:3], n[3:6], n[6:9])
    return Torus(n[:3], n[6], n[7], n[3:6])
