"""Runs the hard cases that are images, for tools/peers/hard-cases. Each case renders with a program and checks the pixels."""
import json
import pathlib
import struct
import tempfile
from math import atan, cos, degrees, radians, sin, sqrt, tan

from hard_cases_programs import Embree, Glint, Povray, Tachyon, povray, tachyon, triple
from scene import NotModelled, cross, dot, unit
from tachyon import flipped, frustum, scene_head

U = 2.0**-24


def along(a, factor, b):
    return [x + factor * y for x, y in zip(a, b)]


class Camera:
    def __init__(self, eye, look_at, half_tangent, size, up=(0, 1, 0)):
        self.eye, self.look_at, self.half_tangent, self.size = eye, look_at, half_tangent, size
        self.forward = unit(along(look_at, -1, eye))
        self.right = unit(cross(self.forward, up))
        self.up = cross(self.right, self.forward)

    def ray(self, column, row):
        """Returns the direction through a pixel's center."""
        width, height = self.size
        x, y = 2 * column + 1 - width, height - 1 - 2 * row
        step = self.half_tangent / height
        return along(along(self.forward, x * step, self.right), y * step, self.up)

    def pixels(self):
        return [(column, row) for row in range(self.size[1]) for column in range(self.size[0])]


class Look:
    """The emission, diffuse reflection and highlight that all objects of an image share."""

    def __init__(self, ambient=0.0, diffuse=0.0, specular=0.0, shininess=1.0):
        self.ambient, self.diffuse, self.specular, self.shininess = ambient, diffuse, specular, shininess


def draw(program, camera, objects, look, light=None):
    """Renders gray values, 0 to 255, row by row. Objects are (kind, members). `light` is ("point", position, intensity) or
    ("directional", direction of travel, a distant point that it comes from, a point that it passes, intensity)."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        scene, image = folder / "scene", folder / "image.ppm"
        if isinstance(program, Povray):
            scene.write_text(povray_scene(program, camera, objects, look, light))
            povray([f"+I{scene}", f"+O{image}", *(f"+{k}{n}" for k, n in zip("WH", camera.size))])
        elif isinstance(program, Tachyon):
            scene.write_text(tachyon_scene(program, camera, objects, look, light))
            tachyon([scene, "-o", image])
        elif isinstance(program, Glint):
            scene.with_suffix(".yaml").write_text(glint_scene(camera, objects, look, light))
            program.render(scene.with_suffix(".yaml"), image, camera.size)
        else:
            raise NotModelled("leaves shading and secondary rays to the caller")
        return image.read_bytes()[-3 * camera.size[0] * camera.size[1] :][::3]


def povray_scene(program, camera, objects, look, light):
    v = program.vector
    width, height = camera.size
    tall = 2 * camera.half_tangent
    lines = [
        "#version 3.7; global_settings { assumed_gamma 1 }",
        f"camera {{ perspective location {v(camera.eye)} direction {v(camera.forward)}",
        f"right {v([x * tall * width / height for x in camera.right])} up {v([x * tall for x in camera.up])} }}",
    ]
    if light:
        kind, *places, intensity = light
        lines.append(f"light_source {{ {v(places[0 if kind == 'point' else 1])}, rgb {intensity!r}")
        lines.append("}" if kind == "point" else f"parallel point_at {v(places[2])} }}")
    finish = f"ambient {look.ambient!r} diffuse {look.diffuse!r} phong {look.specular!r} phong_size {look.shininess!r}"
    for kind, body in objects:
        lines.append(f"{program.part(kind, body)} pigment {{ rgb 1 }} finish {{ {finish} }} }}")
    return "\n".join(lines)


def glint_scene(camera, objects, look, light):
    scene = {
        "camera": {
            "position": camera.eye,
            "look_at": camera.look_at,
            "fov": degrees(2 * atan(camera.half_tangent)),
        },
        "ambient": [1, 1, 1],
        "materials": {"all": vars(look)},
        "objects": [{kind: body | {"material": "all"}} for kind, body in objects],
    }
    if light:
        kind, *places, intensity = light
        key = "position" if kind == "point" else "direction"
        scene["lights"] = [{kind: {key: places[0], "intensity": intensity}}]
    return json.dumps(scene)


def tachyon_scene(program, camera, objects, look, light):
    view = [*map(flipped, (camera.eye, camera.forward, camera.up)), frustum(camera.half_tangent, camera.size)]
    lines = [scene_head(camera.size, view, written=triple)]
    if light:
        kind, *places, intensity = light
        color = triple([intensity] * 3)
        if kind == "point":
            lines.append(f"Light Center {triple(flipped(places[0]))} Rad 0.01 Color {color}")
        else:
            lines.append(f"Directional_Light Direction {triple(flipped(places[0]))} Color {color}")
    texture = (
        f"Texture Ambient {look.ambient!r} Diffuse {look.diffuse!r} Specular 0 Opacity 1 "
        f"Phong Plastic {look.specular!r} Phong_size {look.shininess!r} Color 1 1 1 TexFunc 0"
    )
    for kind, body in objects:
        lines.append(program.part(kind, {key: flipped(value) for key, value in body.items()}, texture))
    return "\n".join(lines) + "\nEnd_Scene\n"


def silhouette(program, camera, objects):
    """Returns, for each pixel, its ray's direction and whether anything is hit."""
    if isinstance(program, Embree):
        directions = [list(struct.unpack("3f", struct.pack("3f", *camera.ray(*pixel)))) for pixel in camera.pixels()]
        rays = [(camera.eye, direction, 0.0) for direction in directions]
        seen = [answer is not None for answer in program.trace([[part] for part in objects], rays)]
    else:
        directions = [camera.ray(*pixel) for pixel in camera.pixels()]
        seen = [value > 127 for value in draw(program, camera, objects, Look(ambient=1.0))]
    return list(zip(directions, seen))


def fault_of_hit(is_hit, depth, band):
    """Returns the fault of an answer, or None. `depth` is how deep the ray enters the object; within `band`, both are right."""
    if abs(depth) <= band or is_hit == (depth > 0):
        return None
    return "misses" if depth > 0 else "hits for a miss"


def question(ask):
    """Returns a function that collects the generator's faults for a program, and the reason if it was not run."""

    def answer(program):
        try:
            return list(ask(program)), []
        except NotModelled as shape:
            return [], [str(shape)]

    return answer


def fringe(program):
    """S2: a unit sphere from 10 to 10,000 radii away."""
    for distance in (10.0, 100.0, 1000.0, 1e4):
        camera = Camera([0, 0, distance], [0, 0, 0], tan(1.1 / distance), (256, 256))
        for d, is_hit in silhouette(program, camera, [("sphere", {"center": [0, 0, 0], "radius": 1.0})]):
            depth = 1 - distance * distance * (d[0] ** 2 + d[1] ** 2) / dot(d, d)
            yield fault_of_hit(is_hit, depth, 4 * U * distance)


def wire(program):
    """C3: a wire 20,000 long, 2.5 pixels thick."""
    radius = 1e-3
    camera = Camera([0, 0, -10], [0, 0, 0], tan(radians(0.293 / 2)), (1024, 64))
    body = {"from": [-1e4, 0, 0], "to": [1e4, 0, 0], "radius": radius}
    for d, is_hit in silhouette(program, camera, [("cylinder", body)]):
        yield fault_of_hit(is_hit, 1 - (10 / radius * d[1]) ** 2 / (d[1] ** 2 + d[2] ** 2), 4 * U * 10 / radius)


def thin_ring(program):
    """T5: a torus thinner than a pixel, compared with the exact oracle where a ray comes near it."""
    import exact

    camera = Camera([0, -5, 5], [0, 0, 0], tan(radians(15)), (512, 512))
    body = {"center": [0, 0, 0], "axis": [0, 0, 1], "major": 1.0, "minor": 1e-3}
    band = 4 * U * 7 / 1e-3
    thin, thick = (exact.Torus([0, 0, 0], 1.0, 1e-3 * (1 + change)) for change in (-band, band))
    for d, is_hit in silhouette(program, camera, [("torus", body)]):
        far = -5 / d[2]
        if abs(sqrt((far * d[0]) ** 2 + (far * d[1] - 5) ** 2) - 1) > 0.005:
            yield "hits for a miss" if is_hit else None
            continue
        ray = exact.Ray(camera.eye, d)
        if is_hit:
            yield None if thick.hit(ray) is not None else "hits for a miss"
        else:
            yield "misses" if thin.hit(ray) is not None else None


def acne(program):
    """P2: a plane under grazing light, near and far from the origin, small and large. No part of it is in shadow. The
    light's intensity makes every pixel half white. Tachyon ignores lights whose cosine is below 0.002."""
    normal = unit([1, 2, 3])
    side = unit(cross(normal, [1, 0, 0]))
    for size, offset in ((1, 0), (1, 1e3), (1, 1e6), (1e-4, 0), (1e-4, 1), (1e4, 0)):
        place = [size * a + offset * b for a, b in zip((0.3, -0.2, 0.5), (1, -2, 0.5))]
        camera = Camera(along(along(place, 3 * size, normal), 0.5 * size, side), place, tan(radians(25)), (64, 64))
        for angle in (1, 45) if isinstance(program, Tachyon) else (0.01, 1, 45):
            way = along([sin(radians(angle)) * -x for x in normal], -cos(radians(angle)), side)
            light = ("directional", way, along(place, -1000 * size, way), place, 0.5 / sin(radians(angle)))
            plane = ("plane", {"point": place, "normal": normal})
            for value in draw(program, camera, [plane], Look(diffuse=1.0), light):
                wrong = "pixels in shadow" if value < 60 else "pixels too dark or light"
                yield None if abs(value - 127.5) <= 3 else wrong


def contact(program):
    """R1: the shadow of a sphere on the plane that it touches is a disc of radius 10 / sqrt(80)."""
    camera = Camera([3, 2, 3], [0, 0, 0], tan(radians(25)), (256, 256))
    objects = [("plane", {"point": [0, 0, 0], "normal": [0, 1, 0]}), ("sphere", {"center": [0, 1, 0], "radius": 1.0})]
    values = draw(program, camera, objects, Look(diffuse=1.0), ("point", [0, 10, 0], 1.0))
    for pixel, value in zip(camera.pixels(), values):
        yield contact_fault(camera.eye, camera.ray(*pixel), value)


def contact_fault(eye, d, value):
    f = along(eye, -1, [0, 1, 0])
    half, squared = dot(f, d), dot(d, d)
    root = half * half - squared * (dot(f, f) - 1)
    if abs(root) < 1e-5 * half * half:
        return None
    if root > 0:
        point = along(eye, (-half - sqrt(root)) / squared, d)
        normal = along(point, -1, [0, 1, 0])
        facing = dot(normal, unit(along([0, 10, 0], -1, point)))
        is_lit, margin = facing > 0, abs(facing)
    elif d[1] < 0:
        point = along(eye, -eye[1] / d[1], d)
        ratio = sqrt(dot(point, point) * 80) / 10
        facing = unit(along([0, 10, 0], -1, point))[1]
        is_lit, margin = ratio > 1, abs(ratio - 1)
    else:
        return None
    if margin <= 1e-5 or (is_lit and facing < 4 / 255):
        return None
    if is_lit:
        return None if value >= 255 * facing / 2 else "lit pixels dark"
    return None if value == 0 else "shadowed pixels lit"


STAGE = [
    ("sphere", {"center": [-0.5, 0.25, 0.0], "radius": 0.75}),
    ("box", {"min": [0.5, -0.5, -0.5], "max": [1.25, 0.25, 0.5]}),
    ("triangle", {"vertices": [[-2.0, -0.5, -1.0], [2.0, -0.5, -1.5], [0.5, 1.5, -1.0]]}),
    ("sphere", {"center": [0.5, 0.75, 0.5], "radius": 0.25}),
]


def transformed(value, function):
    if isinstance(value, list):
        if isinstance(value[0], list):
            return [transformed(part, function) for part in value]
        return function(value)
    return value


def scales(program):
    """R6: the image of the scene 2^k times as large is the same, bit for bit."""
    images = []
    for k in (0, -20, -10, -3, 3, 10, 20):
        def scaled(vector, factor=2.0**k):
            return [x * factor for x in vector]

        objects = [(kind, {key: transformed(value, scaled) for key, value in body.items()}) for kind, body in STAGE]
        for _, body in objects:
            if "radius" in body:
                body["radius"] *= 2.0**k
        camera = Camera(scaled([1, 1, 5]), [0, 0, 0], 0.375, (64, 48))
        images.append(draw(program, camera, objects, Look(0.125, 0.75), ("point", scaled([3, 5, 4]), 0.75)))
    for image in images[1:]:
        yield from ("pixels changed by scale" if a != b else None for a, b in zip(image, images[0]))


def mirrored(program):
    """R7: the mirrored scene renders to the mirrored image, bit for bit."""
    for width in (64, 63):
        images = []
        for sign in (1, -1):
            def turned(vector, sign=sign):
                return [sign * vector[0], *vector[1:]]

            objects = [(kind, {key: transformed(value, turned) for key, value in body.items()}) for kind, body in STAGE]
            for _, body in objects:
                if "min" in body and sign < 0:
                    body["min"][0], body["max"][0] = body["max"][0], body["min"][0]
            camera = Camera([0, 1, 5], [0, 0, 0], 0.375, (width, 48))
            images.append(draw(program, camera, objects, Look(0.125, 0.75), ("point", turned([3, 5, 4]), 0.75)))
        first, second = ([image[i : i + width] for i in range(0, len(image), width)] for image in images)
        for row, other in zip(first, second):
            yield from ("pixels changed by mirroring" if a != b else None for a, b in zip(row, other[::-1]))


def exponents(program):
    """R5: Phong's highlight on a sphere, to 2e-3 and the rounding of eight bits."""
    eye, place = [0, 0, 5], [2, 3, 5]
    camera = Camera(eye, [0, 0, 0], tan(radians(12)), (128, 128))
    for shininess in (1.0, 10.0, 100.0, 1e3, 1e4):
        look = Look(specular=1.0, shininess=shininess)
        values = draw(program, camera, [("sphere", {"center": [0, 0, 0], "radius": 1.0})], look, ("point", place, 1.0))
        for pixel, value in zip(camera.pixels(), values):
            yield highlight_fault(eye, camera.ray(*pixel), place, shininess, value)


def highlight_fault(eye, d, place, shininess, value):
    half, squared = dot(eye, d), dot(d, d)
    root = half * half - squared * (dot(eye, eye) - 1)
    if abs(root) < 1e-4 * half * half:
        return None
    expected = 0.0
    if root > 0:
        normal = along(eye, (-half - sqrt(root)) / squared, d)
        to_light, to_eye = unit(along(place, -1, normal)), unit([-x for x in d])
        facing = dot(normal, to_light)
        if abs(facing) < 1e-5:
            return None
        if facing > 0:
            expected = max(dot(along([-x for x in to_light], 2 * facing, normal), to_eye), 0.0) ** shininess
    return None if abs(value / 255 - expected) <= 2e-3 + 1 / 255 else "highlights off"


IMAGES = {
    "S2": ("silhouette of a sphere from far away, an image", question(fringe)),
    "C3": ("wire, an image", question(wire)),
    "T5": ("ring thinner than a pixel, an image", question(thin_ring)),
    "P2": ("plane under grazing light", question(acne)),
    "R1": ("shadow where a sphere touches its plane", question(contact)),
    "R5": ("highlights with powers up to 10,000", question(exponents)),
    "R6": ("the same image at every power of two", question(scales)),
    "R7": ("the mirrored scene's image", question(mirrored)),
}
