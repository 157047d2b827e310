"""Reads scenes for the oracle from the YAML of docs/scene-format.md, without meshes and images on surfaces.

As docs/verify.md states, the eye is subtracted in double, then each number is rounded once to the precision. The rest is
exact."""

import struct

import exact
from exact import dot, rational, subtract, vector
from flint import arb


def narrow(number):
    """Returns the number rounded to float."""
    return struct.unpack("f", struct.pack("f", number))[0]


class Material:
    def __init__(self, given, rounding):
        def number(name, default):
            return rational(rounding(given.get(name, default)))

        def color(values):
            return [rational(rounding(x)) for x in values]

        def channels(name, default):
            value = given.get(name, default)
            return color(value if isinstance(value, list) else [value] * 3)

        self.color = color(given.get("color", [1, 1, 1]))
        self.diffuse, self.specular = channels("diffuse", 1), channels("specular", 0)
        self.ambient, self.shininess = number("ambient", 1), number("shininess", 32)
        self.reflection, self.filter = channels("reflection", 0), channels("transmission", 0)
        self.transmission = max(self.filter)
        self.ior, self.fresnel = number("ior", 1.5), given.get("fresnel", False)
        self.emission = channels("emission", 0)
        self.checker = None
        if "checker" in given:
            self.checker = [color(c) for c in given["checker"]["colors"]]
            self.square = rational(float(given["checker"].get("size", 1)))


class Light:
    def __init__(self, kind, given, rounding, from_eye):
        self.kind = kind
        intensity = float(given.get("intensity", 1))
        self.color = [rational(rounding(float(x) * intensity)) for x in given.get("color", [1, 1, 1])]
        if kind != "directional":
            self.position = from_eye(given["position"])
        if kind != "point":
            there = given.get("direction") or [b - a for a, b in zip(given["position"], given["look_at"])]
            self.direction = vector(float(x) for x in there)
        falloff = given.get("falloff", {"constant": 1})
        falloff = {"quadratic": 1} if falloff == "inverse_square" else falloff
        self.fading = [rational(rounding(float(falloff.get(name, 0)))) for name in ("constant", "linear", "quadratic")]
        if kind == "spot":
            self.angle, self.penumbra = float(given["angle"]), float(given.get("penumbra", 0))


class Thing:
    """One object: its shape, from the eye, its material, and a smooth triangle's normals."""

    def __init__(self, kind, given, material, from_eye, rounding):
        self.kind, self.material, self.normals = kind, material, None
        self.shape = self.make(kind, given, from_eye, rounding)
        if "normals" in given:
            self.normals = [vector(float(x) for x in normal) for normal in given["normals"]]

    def make(self, kind, given, from_eye, rounding):
        def size(name):
            return rounding(given[name])

        def vector(name):
            return [float(x) for x in given[name]]

        if kind == "sphere":
            return exact.Sphere(from_eye(given["center"]), size("radius"))
        if kind == "plane":
            return exact.Plane(from_eye(given["point"]), vector("normal"))
        if kind == "disc":
            return exact.Disc(from_eye(given["center"]), vector("normal"), size("radius"))
        if kind == "box":
            return exact.Box(from_eye(given["min"]), from_eye(given["max"]))
        if kind == "torus":
            return exact.Torus(from_eye(given["center"]), size("major"), size("minor"), vector("axis"))
        if kind == "triangle":
            return exact.Triangle(*map(from_eye, given["vertices"]))
        if "from" in given:
            base = from_eye(given["from"])
            axis = subtract(from_eye(given["to"]), base)
            radii = given["radius"] if kind == "cone" else [given["radius"]] * 2
            return exact.Revolution(base, axis, map(rounding, radii), caps=given.get("caps", True))
        if kind == "cylinder":
            return exact.Revolution(from_eye(given["point"]), vector("axis"), [size("radius")] * 2, infinite=True)
        if kind != "cone":
            raise ValueError(f"the oracle knows no {kind}")
        if "slope" in given:
            slope = rational(given["slope"])
        else:
            slope = exact.middle((arb(rational(float(given["angle"]))) * arb.pi() / 180).tan())
        return exact.DoubleCone(from_eye(given["apex"]), vector("axis"), slope)

    def outward(self, point):
        """Returns the geometric normal, of any length."""
        return self.shape.normal(point)

    def shading(self, point, geometry):
        """Returns the shading normal, of any length, as balls. On a smooth triangle it is interpolated between those of the
        vertices, each normalized first."""
        if self.normals is None:
            return [arb(x) for x in geometry]
        units = [unit(normal) for normal in self.normals]
        return [sum(share * n[k] for share, n in zip(self.shares(point, geometry), units)) for k in range(3)]

    def shares(self, point, geometry):
        a, b, c = self.shape.vertices
        area = dot(geometry, geometry)
        return [
            dot(geometry, exact.cross(subtract(q, p), subtract(point, p))) / area for p, q in ((b, c), (c, a), (a, b))
        ]

    def lift(self, point, geometry):
        """Returns the way from the point to where rays to lights start, or None if nothing lifts. It goes by the share of each
        vertex along its normal, which faces as the geometry does, to its tangent plane."""
        if self.normals is None:
            return None
        units = [unit(normal) for normal in self.normals]
        if dot(units[0], geometry) < 0:
            units = [[-x for x in n] for n in units]
        if not all(dot(n, geometry) > 0 for n in units):
            return None
        lift = [arb(0)] * 3
        for share, vertex, n in zip(self.shares(point, geometry), self.shape.vertices, units):
            height = dot(subtract(vertex, point), n)
            if exact.middle(height) > 0:
                lift = [x + share * height * y for x, y in zip(lift, n)]
        return lift


def unit(values):
    balls = [arb(x) for x in values]
    size = dot(balls, balls).sqrt()
    return [x / size for x in balls]


class Scene:
    def __init__(self, given, rounding):
        """given: what a scene file says. rounding: to the precision."""
        eye = [float(x) for x in given["camera"]["position"]]

        def from_eye(point):
            return vector(rounding(float(x) - e) for x, e in zip(point, eye))

        materials = {name: Material(body, rounding) for name, body in given.get("materials", {}).items()}
        self.eye = vector(eye)
        self.ambient = [rational(rounding(x)) for x in given.get("ambient", [0, 0, 0])]
        self.background = [rational(rounding(x)) for x in given.get("background", [0, 0, 0])]
        self.lights = [
            Light(kind, body, rounding, from_eye) for light in given.get("lights", []) for kind, body in light.items()
        ]
        self.things = []
        for entry in given["objects"]:
            for kind, body in entry.items():
                name = body.get("material", {})
                material = Material(name, rounding) if isinstance(name, dict) else materials[name]
                self.things.append(Thing(kind, body, material, from_eye, rounding))
