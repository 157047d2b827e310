"""Reads scenes for the oracle from the YAML of docs/scene-format.md, without meshes and images on surfaces.

The numbers are those of the file in double, and the rest is exact."""

import exact
from exact import dot, rational, subtract, vector
from flint import arb


class Material:
    def __init__(self, given):
        def number(name, default):
            return rational(given.get(name, default))

        def channels(name, default):
            value = given.get(name, default)
            return vector(value if isinstance(value, list) else [value] * 3)

        self.color = vector(given.get("color", [1, 1, 1]))
        self.diffuse, self.specular = channels("diffuse", 1), channels("specular", 0)
        self.ambient, self.shininess = number("ambient", 1), number("shininess", 32)
        self.reflection, self.filter = channels("reflection", 0), channels("transmission", 0)
        self.transmission = max(self.filter)
        self.ior, self.fresnel = number("ior", 1.5), given.get("fresnel", False)
        self.emission = channels("emission", 0)
        self.checker = None
        if "checker" in given:
            self.checker = [vector(c) for c in given["checker"]["colors"]]
            self.square = rational(given["checker"].get("size", 1))


class Light:
    def __init__(self, kind, given):
        self.kind = kind
        intensity = float(given.get("intensity", 1))
        self.color = vector(float(x) * intensity for x in given.get("color", [1, 1, 1]))
        if kind != "directional":
            self.position = vector(given["position"])
        if kind != "point":
            there = given.get("direction") or [b - a for a, b in zip(given["position"], given["look_at"])]
            self.direction = vector(there)
        falloff = given.get("falloff", {"constant": 1})
        falloff = {"quadratic": 1} if falloff == "inverse_square" else falloff
        self.fading = [rational(falloff.get(name, 0)) for name in ("constant", "linear", "quadratic")]
        if kind == "spot":
            self.angle, self.penumbra = float(given["angle"]), float(given.get("penumbra", 0))


class Thing:
    """One object: its shape, its material, and a smooth triangle's normals."""

    def __init__(self, kind, given, material):
        self.kind, self.material, self.normals = kind, material, None
        self.shape = self.make(kind, given)
        if "normals" in given:
            self.normals = [vector(normal) for normal in given["normals"]]

    def make(self, kind, given):
        if kind == "sphere":
            return exact.Sphere(given["center"], given["radius"])
        if kind == "plane":
            return exact.Plane(given["point"], given["normal"])
        if kind == "disc":
            return exact.Disc(given["center"], given["normal"], given["radius"])
        if kind == "box":
            return exact.Box(given["min"], given["max"])
        if kind == "torus":
            return exact.Torus(given["center"], given["major"], given["minor"], given["axis"])
        if kind == "triangle":
            return exact.Triangle(*given["vertices"])
        if "from" in given:
            base = vector(given["from"])
            axis = subtract(vector(given["to"]), base)
            radii = given["radius"] if kind == "cone" else [given["radius"]] * 2
            return exact.Revolution(base, axis, radii, caps=given.get("caps", True))
        if kind == "cylinder":
            return exact.Revolution(given["point"], given["axis"], [given["radius"]] * 2, infinite=True)
        if kind != "cone":
            raise ValueError(f"the oracle knows no {kind}")
        # the slope of a scene is a double
        slope = float(exact.fraction((arb(given["angle"]) * arb.pi() / 180).tan()))
        return exact.DoubleCone(given["apex"], given["axis"], slope)

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
    def __init__(self, given):
        """given: what a scene file contains."""
        materials = {name: Material(body) for name, body in given["materials"].items()}
        self.ambient, self.background = vector(given["ambient"]), vector(given["background"])
        self.lights = [Light(kind, body) for light in given["lights"] for kind, body in light.items()]
        self.things = [
            Thing(kind, body, materials[body["material"]]) for entry in given["objects"] for kind, body in entry.items()
        ]
