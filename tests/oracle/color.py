"""Computes the color of an image's ray at 300 bits, and a bound on the error of a renderer that rounds.

Every result carries a first-order bound on rounding. A shape is assumed to be computed exactly except for a displacement of its
surface by `displacement` units in the last place of the magnitudes that it is computed from. If a surface that is so much nearer or
farther gives another answer, or another surface comes in between, the answer is open and nothing is compared."""

from math import floor, inf, log, sqrt

import exact
from exact import cross, dot, fraction, length, middle, off_axis_squared, rational, subtract
from flint import arb, fmpq
from scene import unit

TINY = fmpq(1, 2**150)


def as_float(number):
    return float(fraction(number))


def times(vector, factor):
    return [x * factor for x in vector]


def add(a, b):
    return [p + q for p, q in zip(a, b)]


class Rounding:
    """u: half a unit in the last place of 1. displacement: see above. arithmetic: roundings, in u, that a short formula
    for shading may sum up."""

    def __init__(self, u, displacement, arithmetic):
        self.u, self.displacement, self.arithmetic = u, displacement, arithmetic


class Beam:
    """A ray with what is unsure about it: its origin by `off`, its unit direction by `turn`. left: the thing that it
    leaves, at a cosine to its normal. magnitude: of the numbers that its origin was computed from."""

    def __init__(self, origin, direction, off=0.0, turn=0.0, left=None, cosine=1.0, magnitude=0.0):
        self.ray = exact.Ray(origin, direction)
        self.off, self.turn, self.left, self.cosine, self.magnitude = off, turn, left, cosine, magnitude


def grown(shape, by):
    """Returns the solid with its surface moved outward by so much, or inward below 0."""
    if isinstance(shape, exact.Sphere):
        return exact.Sphere(shape.center, exact.Fraction(shape.radius) + exact.Fraction(by))
    if isinstance(shape, exact.Box):
        return exact.Box([x - rational(by) for x in shape.low], [x + rational(by) for x in shape.high])
    if isinstance(shape, exact.Torus):
        return exact.Torus(shape.center, shape.major, shape.minor + rational(by), shape.axis)
    if isinstance(shape, exact.DoubleCone):
        sine = as_float(shape.slope) / sqrt(1 + as_float(shape.slope) ** 2)
        return exact.DoubleCone(shape.center, shape.axis, shape.slope, -by / sine / length(shape.axis))
    if isinstance(shape, exact.Superellipsoid):
        longer = [times(axis, 1 + rational(by / length(axis))) for axis in shape.axes]
        return exact.Superellipsoid(shape.center, longer, shape.exponent)
    if isinstance(shape, exact.Paraboloid):
        # with its apex moved by s and its focal length f by g, the surface at height z moves by (f s + z g) /
        # sqrt(f (f + z)): by as much at the apex and the rim, and by less between; an infinite one at its apex
        height = shape.end / shape.unit
        f, z = as_float(shape.focal_length), as_float(height)
        wider = 0 if shape.infinite else by * (sqrt(f * (f + z)) - f) / z
        apex = [c - rational(by) / shape.unit * a for c, a in zip(shape.center, shape.axis)]
        focal_length = shape.focal_length + rational(wider)
        return exact.Paraboloid(apex, shape.axis, focal_length, height + 2 * rational(by), shape.infinite, shape.caps)
    ends = rational(by / shape.axis_length)
    slope = (shape.radii[1] - shape.radii[0]) / rational(shape.axis_length)
    wider = rational(by * sqrt(1 + as_float(slope) ** 2))
    radii = [shape.radii[0] + wider - slope * rational(by), shape.radii[1] + wider + slope * rational(by)]
    base = [b - ends * a for b, a in zip(shape.base, shape.axis)]
    return exact.Revolution(base, times(shape.axis, 1 + 2 * ends), radii, shape.infinite, shape.caps)


def off_axis(shape, point):
    p = subtract(point, shape.base if isinstance(shape, exact.Revolution) else shape.center)
    return sqrt(max(as_float(off_axis_squared(p, shape.axis)), 0.0))


def curvature(thing, point):
    """Returns the largest curvature at a place of the surface, which is how fast the shading normal turns."""
    shape = thing.shape
    if thing.normals is not None:
        normals = [[as_float(x) for x in unit(normal)] for normal in thing.normals]
        apart = max(length(subtract(exact.vector(a), exact.vector(b))) for a, b in zip(normals, normals[1:] + normals))
        return 2 * apart * shape.size / length(shape.direction)
    if isinstance(shape, exact.Plane) or isinstance(shape, exact.Box):
        return 0.0
    if isinstance(shape, exact.Torus):
        hole = shape.major_radius - shape.radius
        return 1 / min(shape.radius, hole if hole > 0 else max(off_axis(shape, point), 1e-30))
    if isinstance(shape, exact.Sphere):
        return 1 / shape.radius
    if isinstance(shape, exact.Paraboloid):
        return 1 / (2 * as_float(shape.focal_length))
    return 1 / max(off_axis(shape, point), 1e-30)


def rim_distance(shape, point):
    """Returns how far a place of the surface is from where its normal breaks."""
    if isinstance(shape, exact.Box):
        faces = sorted(as_float(min(abs(x - a), abs(x - b))) for a, x, b in zip(shape.low, point, shape.high))
        return faces[1]
    if isinstance(shape, exact.Revolution) and shape.has_ends():
        height = as_float(dot(subtract(point, shape.base), shape.axis) / shape.axis_squared)
        ends = sorted(abs(h) * shape.axis_length for h in (height, height - 1))
        if ends[0] > 1e-25:
            return ends[0]
        start, end = map(as_float, shape.radii)
        return abs(start + (end - start) * height - off_axis(shape, point))
    if isinstance(shape, exact.Paraboloid) and shape.has_end():
        below = abs(as_float((shape.end - dot(subtract(point, shape.center), shape.axis)) / shape.unit))
        if below > 1e-25:
            return below
        return abs(2 * sqrt(as_float(shape.focal_length * shape.end / shape.unit)) - off_axis(shape, point))
    return inf


class Crossing:
    """The first hit of a beam on a thing, at `t` to the best of knowledge, between low and high. If it is missed, low is
    infinite, and if that is open, high is."""

    def __init__(self, low=inf, t=None, high=inf):
        self.low, self.t, self.high = low, t, high


def flat_crossing(thing, beam, rounding):
    shape, ray = thing.shape, beam.ray
    if beam.left is thing:
        return Crossing()
    along = dot(shape.direction, ray.direction)
    if along == 0:
        return Crossing()
    t = dot(shape.direction, subtract(shape.center, ray.origin)) / along
    far = abs(as_float(t)) * ray.scale
    cosine = abs(as_float(along)) / length(shape.direction) / ray.scale
    magnitude = beam.magnitude + shape.distance(ray) + shape.size
    slack = rounding.displacement * rounding.u * magnitude + beam.off + beam.turn * far
    middle_t, spread = as_float(t), slack / cosine / ray.scale
    if middle_t + spread <= 0:
        return Crossing()
    if not rim_is_clear(shape, ray, t, slack / cosine):
        return Crossing(middle_t - spread)
    if not shape.crossings(ray):
        return Crossing()
    if middle_t - spread <= 0:
        return Crossing(middle_t - spread)
    return Crossing(middle_t - spread, t, middle_t + spread)


def rim_is_clear(shape, ray, t, slack):
    if isinstance(shape, exact.Disc):
        return abs(sqrt(as_float(shape.off(ray, t))) - shape.radius) > slack
    if not isinstance(shape, exact.Triangle):
        return True
    sides = set()
    for edge, side in zip(shape.edges(ray), shape.sides):
        across = length(cross(side, ray.direction))
        if across > 0 and abs(as_float(edge)) > slack * across:
            sides.add(edge > 0)
        else:
            sides.add(None)
    return {True, False} <= sides or None not in sides


def solid_crossing(thing, beam, rounding):
    shape, ray = thing.shape, beam.ray
    distance = shape.distance(ray)
    magnitude = beam.magnitude + distance + shape.size
    slack = rounding.displacement * rounding.u * magnitude + beam.off + beam.turn * magnitude
    infinite = isinstance(shape, exact.DoubleCone) or getattr(shape, "infinite", False)
    if not infinite:
        toward = [as_float(x) for x in subtract(shape.center, ray.origin)]
        way = [as_float(x) / ray.scale for x in ray.direction]
        along = dot(toward, way)
        if sum((x - along * y) ** 2 for x, y in zip(toward, way)) > (1.001 * shape.size + 2 * slack) ** 2:
            return Crossing()
    start = fmpq(0)
    if beam.left is thing:
        # where it leaves, each of the three surfaces is crossed within a little of the others
        bend = curvature(thing, ray.origin)
        if beam.cosine**2 <= 16 * slack * bend or beam.cosine == 0:
            return Crossing(0.0)
        start = rational(4 * slack / beam.cosine / ray.scale)
    firsts = []
    for by in (0.0, slack, -slack):
        surface = grown(shape, by) if by else shape
        firsts.append(next((t for t in surface.crossings(ray) if t > start), None))
    places = [as_float(t) for t in firsts if t is not None]
    if not places:
        return Crossing()
    if len(places) < 3:
        return Crossing(min(places))
    return Crossing(min(places), firsts[0], max(places))


def crossing(thing, beam, rounding):
    kind = flat_crossing if isinstance(thing.shape, exact.Plane) else solid_crossing
    return kind(thing, beam, rounding)


class Hit:
    """A surface as a beam hits it. off: how far the place, turn: how far the unit normal may be off."""

    def __init__(self, thing, index, met, beam, rounding):
        shape, ray = thing.shape, beam.ray
        self.thing, self.index, self.t = thing, index, met.t
        self.low, self.high = met.low, met.high
        self.point = [middle(x) for x in ray.at(met.t)]
        along = max(met.high - as_float(met.t), as_float(met.t) - met.low) * ray.scale
        far = as_float(met.t) * ray.scale
        self.magnitude = beam.magnitude + far + shape.distance(ray) + shape.size
        self.off = along + beam.off + beam.turn * far + rounding.u * self.magnitude
        self.bend = curvature(thing, self.point)
        self.turn = self.bend * self.off + rounding.arithmetic * rounding.u
        outward = thing.outward(self.point)
        self.against = dot(outward, ray.direction) < 0
        flat = isinstance(shape, exact.Plane)
        self.entering = self.against if flat else not shape.contains(ray.at(met.t - TINY))
        self.facing = outward if self.against else times(outward, -1)
        self.geometry = unit(self.facing)
        shading = unit(thing.shading(self.point, outward))
        if as_float(dot(shading, self.geometry)) < 0:
            shading = times(shading, -1)
        self.normal = shading
        self.to_eye = times(unit(ray.direction), -1)
        self.is_open = rim_distance(shape, self.point) <= 2 * self.off or self.turn > 0.1


def nearest(scene, beam, rounding):
    """Returns the hit, None for a miss, or "open"."""
    met = [crossing(thing, beam, rounding) for thing in scene.things]
    first = min(range(len(met)), key=lambda i: (met[i].high, met[i].low), default=None)
    if first is None:
        return None
    if any(i != first and m.low < met[first].high for i, m in enumerate(met)):
        return "open"
    if met[first].low == inf:
        return None
    if met[first].high == inf:
        return "open"
    hit = Hit(scene.things[first], first, met[first], beam, rounding)
    return "open" if hit.is_open else hit


def leaving(hit, direction, turn, rounding):
    """Returns a beam from a hit, which renderers start off the surface by a few of the hit's errors."""
    start = hit.off + 48 * rounding.u * hit.magnitude
    cosine = abs(as_float(dot(hit.geometry, unit(direction))))
    return Beam(hit.point, [middle(x) for x in direction], start, turn, hit.thing, cosine, hit.magnitude)


class Sum:
    """A color as balls, with a bound on the error of its three channels."""

    def __init__(self, color=(0, 0, 0), error=0.0):
        self.color, self.error = [arb(x) for x in color], error

    def add(self, color, error):
        self.color, self.error = add(self.color, color), self.error + error


def checker_color(hit, rounding, eye):
    """Returns the color of the place's square, or None if a border is too near to decide."""
    material, kind = hit.thing.material, hit.thing.kind
    point = [arb(p + e) for p, e in zip(hit.point, eye)]
    if kind in ("plane", "disc"):
        normal = unit(hit.thing.shape.direction)
        sizes = [abs(as_float(x)) for x in normal]
        axis = [arb(int(k == sizes.index(min(sizes)))) for k in range(3)]
        first = unit(subtract(axis, times(normal, dot(axis, normal))))
        places = [dot(point, first), dot(point, cross(normal, first))]
    else:
        places = subtract(point, times(hit.geometry, arb(material.square) / 1024))
    squares, square = 0, as_float(material.square)
    for place in places:
        cell = as_float(place / material.square)
        # the eye's place among the squares has its own rounding, of up to two squares
        slack = (2 * hit.off + rounding.arithmetic * rounding.u * hit.magnitude) / square
        if abs(cell - round(cell)) <= slack + rounding.arithmetic * rounding.u * 2:
            return None
        squares += floor(cell)
    return material.checker[squares % 2]


def spot_strength(light, from_light, turn, rounding):
    """Returns (strength, error), or None on a hard edge."""
    versine = 1 - dot(unit(light.direction), unit(from_light))
    outer, inner = (1 - (arb(rational(a)) * arb.pi() / 180).cos() for a in (light.angle, light.angle - light.penumbra))
    s = as_float(versine)
    error = sqrt(2 * s) * turn + turn * turn + rounding.arithmetic * rounding.u * s
    if min(abs(s - as_float(edge)) for edge in (inner, outer)) <= error and light.penumbra == 0:
        return None
    if versine > outer:
        return arb(0), error if s - as_float(outer) <= error else 0.0
    if versine <= inner:
        return arb(1), 0.0 if as_float(inner) - s > error else 1.5 * error / as_float(outer - inner)
    x = (outer - versine) / (outer - inner)
    relative = rounding.arithmetic * rounding.u
    return x * x * (3 - 2 * x), 1.5 * error / as_float(outer - inner) + relative


def passing(scene, hit, way, end, turn, rounding):
    """Returns the parts of a light's channels that get through, or None if that is open."""
    beam = leaving(hit, way, turn, rounding)
    lift = hit.thing.lift(hit.point, hit.facing)
    if lift is not None:
        start = [middle(p + x) for p, x in zip(hit.point, lift)]
        if end != inf:
            way = subtract(add(hit.point, way), start)
        # a place moves a vertex's share and its height
        shape = hit.thing.shape
        off = beam.off * (2 + 3 * shape.size**2 / length(shape.direction))
        sinks = as_float(dot(hit.geometry, unit(way))) <= turn
        beam = Beam(start, [middle(x) for x in way], off, turn, None if sinks else hit.thing, 1.0, hit.magnitude)
    parts, is_open = [arb(1)] * 3, False
    for thing in scene.things:
        met = crossing(thing, beam, rounding)
        if met.low >= end:
            continue
        if met.high >= end:
            is_open = True
        else:
            parts = [part * passed for part, passed in zip(parts, thing.material.filter)]
            if all(part == 0 for part in parts):
                return parts
    return None if is_open else parts


def highlight(hit, to_light, facing, facing_error, turn, rounding):
    """Returns (R . V)^shininess and its error."""
    exponent = hit.thing.material.shininess
    power = as_float(exponent)
    if power == 0:
        return arb(1), 0.0
    mirrored = subtract(times(hit.normal, 2 * facing), to_light)
    alignment = dot(mirrored, hit.to_eye)
    spread = 2 * facing_error + 2 * as_float(facing) * hit.turn + turn + 2 * rounding.arithmetic * rounding.u
    cosine = as_float(alignment)
    change = sqrt(max(1 - cosine * cosine, 0.0)) * spread + spread * spread + rounding.arithmetic * rounding.u
    if cosine + change <= 0:
        return arb(0), 0.0
    nearest_cosine = min(cosine + change, 1.0)
    if cosine <= change:
        return (arb(alignment) ** arb(exponent) if cosine > 0 else arb(0)), nearest_cosine**power
    value = (exponent * alignment.log()).exp()
    relative = rounding.arithmetic * rounding.u * (1 + power * abs(log(min(cosine, 1.0))))
    return value, power * nearest_cosine ** (power - 1) * change + as_float(value) * relative


def lit(scene, light, hit, base, rounding, total):
    """Adds what a light gives. Returns whether the place is in its shadow, or None if that is open."""
    u, material = rounding.u, hit.thing.material
    infinite = light.kind == "directional"
    way = times(light.direction, -1) if infinite else subtract(light.position, hit.point)
    to_light = unit(way)
    turn = 4 * u + (0.0 if infinite else hit.off / length(way))
    facing = dot(hit.normal, to_light)
    facing_error = hit.turn + turn + rounding.arithmetic * u
    if abs(as_float(facing)) <= facing_error:
        return None
    if facing < 0:
        return True
    strength, strength_error = arb(1), 0.0
    if light.kind == "spot":
        spot = spot_strength(light, times(way, -1), turn, rounding)
        if spot is None:
            return None
        strength, strength_error = spot
        if strength == 0:
            return True if strength_error == 0 else None
    if light.fading != [1, 0, 0]:
        distance = arb(dot(way, way)).sqrt()
        fading = 1 / (light.fading[0] + distance * (light.fading[1] + distance * light.fading[2]))
        off = 2.1 * hit.off / length(way) + rounding.arithmetic * u
        strength, strength_error = strength * fading, (strength_error + off) * as_float(fading)
    parts = passing(scene, hit, way, inf if infinite else 1.0, turn, rounding)
    if parts is None:
        return None
    if all(part == 0 for part in parts):
        return True
    shine, shine_error = highlight(hit, to_light, facing, facing_error, turn, rounding)
    color, errors = [], []
    for k in range(3):
        surface = material.diffuse[k] * base[k] * facing + material.specular[k] * shine
        error = as_float(material.diffuse[k] * base[k]) * facing_error + as_float(material.specular[k]) * shine_error
        reached = light.color[k] * strength * parts[k]
        color.append(reached * surface)
        errors.append(
            as_float(reached) * error
            + as_float(light.color[k] * surface * parts[k]) * strength_error
            + rounding.arithmetic * u * as_float(reached * surface)
        )
    total.add(color, max(errors))
    return False


def refracted(hit, direction, rounding):
    """Returns (direction, how far it may be turned per turn of ray and normal), (None, 0) at total reflection, None if open."""
    ior = arb(hit.thing.material.ior)
    eta = 1 / ior if hit.entering else ior
    cosine = -dot(direction, hit.normal)
    squared = 1 - eta * eta * (1 - cosine * cosine)
    band = rounding.arithmetic * rounding.u + 2 * as_float(eta) ** 2 * (hit.turn + rounding.u)
    if abs(as_float(squared)) <= 16 * band:
        return None
    if squared < 0:
        return None, 0.0
    root = squared.sqrt()
    passed = add(times(direction, eta), times(hit.normal, eta * cosine - root))
    gain = as_float(eta + abs(eta * cosine - root) + eta * eta * cosine / root)
    return passed, gain


def reflectance(hit, cosine):
    """Returns the part of unpolarized light that the surface reflects, by Fresnel's equations."""
    ior = arb(hit.thing.material.ior)
    entering = hit.entering or hit.thing.material.transmission == 0
    there = 1 / ior if entering else ior  # the sine behind the surface over that before it
    squared = 1 - there * there * (1 - cosine * cosine)
    if squared <= 0:
        return arb(1)
    behind = squared.sqrt()
    near, far = (arb(1), ior) if entering else (ior, arb(1))
    across = (near * cosine - far * behind) / (near * cosine + far * behind)
    along = (near * behind - far * cosine) / (near * behind + far * cosine)
    return (across * across + along * along) / 2


def reflectance_bounded(hit, direction, turn, rounding):
    """Returns (reflectance, how far a turn of ray and normal may change it)."""
    cosine = -dot(direction, hit.normal)
    part = reflectance(hit, cosine)
    change = max(abs(as_float(reflectance(hit, cosine + way * arb(turn)) - part)) for way in (-1, 1))
    return part, 2 * change + rounding.arithmetic * rounding.u


class Answer:
    """hit: of the first surface, None, or "open"; shadows: of each light True, False or None; color: None where it is
    open."""

    def __init__(self, hit=None, shadows=(), color=None):
        self.hit, self.shadows, self.color = hit, shadows, color


def trace(scene, beam, rounding, bounces):
    hit = nearest(scene, beam, rounding)
    if hit is None:
        return Answer(None, (), Sum(scene.background))
    if hit == "open":
        return Answer("open")
    material, u = hit.thing.material, rounding.u
    base = checker_color(hit, rounding, scene.eye) if material.checker else material.color
    total = Sum()
    total.add([i * material.ambient * c + e for i, c, e in zip(scene.ambient, base or scene.ambient, material.emission)], 0.0)
    total.error = 3 * rounding.arithmetic * u * max(as_float(x) for x in total.color)
    shadows = [lit(scene, light, hit, base or material.color, rounding, total) for light in scene.lights]
    if None in shadows or base is None:
        return Answer(hit, shadows)
    if bounces > 0 and not follow(scene, hit, beam, rounding, bounces, total):
        return Answer(hit, shadows)
    total.error += rounding.arithmetic * u * max(as_float(x) for x in total.color)
    return Answer(hit, shadows, total)


def follow(scene, hit, beam, rounding, bounces, total):
    """Adds the mirrored and the refracted ray's color. Returns False if that is open."""
    material = hit.thing.material
    direction = times(hit.to_eye, -1)
    reflection, transmission = list(material.reflection), arb(material.transmission)
    kept, part_error = arb(0), 0.0
    if material.fresnel:
        part, part_error = reflectance_bounded(hit, direction, beam.turn + hit.turn + rounding.u, rounding)
        if transmission > 0:
            kept, transmission = part * transmission, (1 - part) * transmission
        else:
            reflection = times(reflection, part)
    own = rounding.arithmetic * rounding.u
    if material.transmission > 0:
        through = refracted(hit, direction, rounding)
        if through is None:
            return False
        passed, gain = through
        if passed is None:
            kept, transmission = arb(material.transmission), arb(0)
    mirrored = [arb(r) + kept for r in reflection]
    filtered = [transmission * channel / material.transmission for channel in material.filter] if transmission != 0 else [arb(0)] * 3
    for weights, kind in ((mirrored, "mirrored"), (filtered, "passed")):
        if all(weight == 0 for weight in weights):
            continue
        if kind == "mirrored":
            away = dot(direction, hit.normal)
            way, turn = subtract(direction, times(hit.normal, 2 * away)), beam.turn + 2 * hit.turn + own
        else:
            way, turn = passed, gain * (beam.turn + hit.turn) + own
        seen = trace(scene, leaving(hit, way, turn, rounding), rounding, bounces - 1)
        if seen.color is None:
            return False
        color = [c * weight for c, weight in zip(seen.color.color, weights)]
        largest = max(as_float(weight) for weight in weights)
        error = (part_error + own * largest) * max(as_float(c) for c in seen.color.color)
        total.add(color, largest * seen.color.error + error)
    return True
