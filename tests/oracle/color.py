"""Computes what a ray of an image and its reflections and refractions show, at 300 bits, by the formulas of docs/scene-format.md."""

from math import floor

import exact
from exact import cross, dot, fraction, middle, rational, subtract
from flint import arb, fmpq
from scene import unit

TINY = fmpq(1, 2**150)  # a crossing nearer to the start of a ray is of the surface that it leaves
PATH_START, PATH_FACTOR, PATH_EVENTS, EVENT_REFLECTED, EVENT_REFRACTED, EVENT_TOTAL = 0x811C9DC5, 0x01000193, 8, 1, 2, 4
NONE = 2**32 - 1  # the object of the background


def times(vector, factor):
    return [x * factor for x in vector]


def add(a, b):
    return [p + q for p, q in zip(a, b)]


def channels(a, b):
    return [p * q for p, q in zip(a, b)]


def is_flat(thing):
    return isinstance(thing.shape, exact.Plane)


def ray_from(point, way):
    """Returns a ray whose numbers are rounded to 300 bits, which keeps them short."""
    return exact.Ray([middle(arb(x)) for x in point], [middle(arb(x)) for x in way])


def first_crossing(thing, ray, start):
    """Returns t of the first crossing beyond the start, or None."""
    shape = thing.shape
    if not (is_flat(thing) or isinstance(shape, exact.DoubleCone) or getattr(shape, "infinite", False)):
        toward, way = exact.floats(subtract(shape.center, ray.origin)), exact.floats(ray.direction)
        along = dot(toward, way) / ray.scale
        if dot(toward, toward) - along * along > 1.001 * shape.size**2:
            return None
    return next((t for t in shape.crossings(ray) if t > start), None)


class Hit:
    """A surface as a ray hits it. The normals are those of the side that the ray comes from."""

    def __init__(self, scene, index, ray, t):
        self.index, self.thing = index, scene.things[index]
        self.material = self.thing.material
        self.point = [middle(arb(x)) for x in ray.at(t)]
        outward = self.thing.outward(ray.at(t))
        is_against = dot(outward, ray.direction) < 0
        self.entering = is_against if is_flat(self.thing) else not self.thing.shape.contains(ray.at(t - TINY))
        self.facing = outward if is_against else times(outward, -1)
        self.geometry = unit(self.facing)
        self.normal = unit(self.thing.shading(self.point, outward))
        if dot(self.normal, self.geometry) < 0:
            self.normal = times(self.normal, -1)
        self.direction = unit(ray.direction)
        self.to_eye = times(self.direction, -1)
        self.base = checker_color(self) if self.material.checker else self.material.color


def nearest(scene, ray, start):
    """Returns the first hit beyond the start, or None. An opaque surface covers a transparent one that coincides with it."""
    met = [(first_crossing(thing, ray, start), index) for index, thing in enumerate(scene.things)]
    hits = [(t, scene.things[index].material.transmission > 0, index) for t, index in met if t is not None]
    if not hits:
        return None
    t, _, index = min(hits)
    return Hit(scene, index, ray, t)


def checker_color(hit):
    """Returns the color of the place's square."""
    material = hit.material
    if hit.thing.kind in ("plane", "disc"):
        normal = unit(hit.thing.shape.direction)
        sizes = [abs(float(fraction(x))) for x in normal]
        axis = [arb(int(k == sizes.index(min(sizes)))) for k in range(3)]
        first = unit(subtract(axis, times(normal, dot(axis, normal))))
        places = [dot(hit.point, first), dot(hit.point, cross(normal, first))]
    else:
        places = subtract(hit.point, times(hit.geometry, arb(material.square) / 1024))
    return material.checker[sum(floor(fraction(place / material.square)) for place in places) % 2]


def spot_strength(light, from_light):
    versine = 1 - dot(unit(light.direction), unit(from_light))
    outer, inner = (1 - (arb(rational(a)) * arb.pi() / 180).cos() for a in (light.angle, light.angle - light.penumbra))
    if versine >= outer:
        return arb(0)
    x = (outer - versine) / (outer - inner) if versine > inner else arb(1)
    return x * x * (3 - 2 * x)


def passing(scene, hit, way, is_infinite):
    """Returns the part of each channel of a light that gets through."""
    start, sinks, lift = hit.point, dot(hit.geometry, way) <= 0, hit.thing.lift(hit.point, hit.facing)
    if lift is not None:
        start = add(hit.point, lift)
        way = way if is_infinite else subtract(way, lift)
    ray, parts = ray_from(start, way), [arb(1)] * 3
    for thing in scene.things:
        t = first_crossing(thing, ray, TINY)
        is_passed = t is not None and (is_infinite or t < 1)
        if thing is hit.thing and is_flat(thing):
            is_passed = sinks and (lift is None or is_passed)
        if is_passed:
            parts = channels(parts, thing.material.filter)
    return parts


def highlight(hit, to_light, facing):
    """Returns max(0, R . V)^shininess."""
    exponent = hit.material.shininess
    alignment = dot(subtract(times(hit.normal, 2 * facing), to_light), hit.to_eye)
    if exponent == 0:
        return arb(1)
    return (exponent * alignment.log()).exp() if alignment > 0 else arb(0)


def lit(scene, light, hit):
    """Returns the color that a light adds, or None if the light does not reach the surface."""
    is_infinite = light.kind == "directional"
    way = times(light.direction, -1) if is_infinite else subtract(light.position, hit.point)
    to_light = unit(way)
    facing = dot(hit.normal, to_light)
    if facing <= 0:
        return None
    strength = spot_strength(light, times(way, -1)) if light.kind == "spot" else arb(1)
    if light.fading != [1, 0, 0]:
        distance = arb(dot(way, way)).sqrt()
        strength /= light.fading[0] + distance * (light.fading[1] + distance * light.fading[2])
    parts = passing(scene, hit, way, is_infinite) if strength > 0 else [arb(0)]
    if not any(part > 0 for part in parts):
        return None
    diffuse = times(channels(hit.material.diffuse, hit.base), facing)
    surface = add(diffuse, times(hit.material.specular, highlight(hit, to_light, facing)))
    return times(channels(channels(light.color, parts), surface), strength)


def mirrored(hit):
    """Returns the direction of the reflected ray. If a smooth triangle's normal sends it to the wrong side, that is the
    geometric normal's."""
    ways = [subtract(hit.direction, times(n, 2 * dot(hit.direction, n))) for n in (hit.normal, hit.geometry)]
    return ways[0] if dot(ways[0], hit.geometry) > 0 else ways[1]


def refracted(hit):
    """Returns the direction of the refracted ray, or None at total reflection."""
    ior = arb(hit.material.ior)
    eta = 1 / ior if hit.entering else ior
    for normal in (hit.normal, hit.geometry):
        cosine = -dot(hit.direction, normal)
        squared = 1 - eta * eta * (1 - cosine * cosine)
        if squared < 0:
            return None
        way = add(times(hit.direction, eta), times(normal, eta * cosine - squared.sqrt()))
        if dot(way, hit.geometry) < 0:
            return way
    return None


def reflectance(hit):
    """Returns the part of unpolarized light that the surface reflects, by Fresnel's equations."""
    cosine, ior = dot(hit.to_eye, hit.normal), arb(hit.material.ior)
    near, far = (arb(1), ior) if hit.entering or hit.material.transmission == 0 else (ior, arb(1))
    sine_squared = near * near / (far * far) * (1 - cosine * cosine)
    if sine_squared >= 1:
        return arb(1)
    behind = (1 - sine_squared).sqrt()
    across = (near * cosine - far * behind) / (near * cosine + far * behind)
    along = (near * behind - far * cosine) / (near * behind + far * cosine)
    return (across * across + along * along) / 2


def split(hit, is_total):
    """Returns the parts of the light, by channel, that the reflected and the refracted ray carry."""
    material = hit.material
    part = arb(1) if is_total else reflectance(hit) if material.fresnel else arb(0)
    if material.transmission > 0:
        return [r + part * material.transmission for r in material.reflection], times(material.filter, 1 - part)
    return times(material.reflection, part if material.fresnel else 1), [arb(0)] * 3


class Pixel:
    """What a ray shows: the first object, whether each light fails to reach it, the signature of the ray's tree
    (kernels/types.h), and the color."""

    def __init__(self, scene, ray, bounces):
        self.scene, self.object, self.shadows, self.path, self.color = scene, NONE, None, PATH_START, [arb(0)] * 3
        self.follow(ray, fmpq(0), [arb(1)] * 3, bounces)

    def show(self, color, weight):
        self.color = add(self.color, channels(color, weight))

    def sign(self, index, events):
        self.path = (self.path ^ ((index + 1) % 2**32 * PATH_EVENTS + events)) * PATH_FACTOR % 2**32

    def follow(self, ray, start, weight, bounces):
        """Adds what a ray and its bounces show."""
        scene, hit = self.scene, nearest(self.scene, ray, start)
        if hit is None:
            self.show(scene.background, weight)
            self.sign(NONE, 0)
            return
        lights = [lit(scene, light, hit) for light in scene.lights]
        if self.shadows is None:
            self.object, self.shadows = hit.index, [color is None for color in lights]
        material = hit.material
        self.show(add(times(channels(scene.ambient, hit.base), material.ambient), material.emission), weight)
        for color in lights:
            self.show(color or [0] * 3, weight)
        if bounces == 0:
            self.sign(hit.index, 0)
            return
        passed = refracted(hit) if material.transmission > 0 else None
        is_total = material.transmission > 0 and passed is None
        reflected, through = (channels(weight, part) for part in split(hit, is_total))
        reflects, refracts = (any(x > 0 for x in part) for part in (reflected, through))
        self.sign(hit.index, EVENT_REFLECTED * reflects + EVENT_REFRACTED * refracts + EVENT_TOTAL * (reflects and is_total))
        if reflects:
            self.follow(ray_from(hit.point, mirrored(hit)), TINY, reflected, bounces - 1)
        if refracts:
            self.follow(ray_from(hit.point, passed), TINY, through, bounces - 1)
