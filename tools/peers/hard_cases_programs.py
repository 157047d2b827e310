"""Traces rays with other programs, for tools/peers/hard-cases."""
import ctypes
import itertools
import math
import pathlib
import shutil
import struct
import subprocess
import tempfile
from array import array

from povray import vector
from scene import NotModelled, triple as scene_triple
from tachyon import scene_head


def number(value):
    return repr(float(value))


def triple(values):
    return scene_triple(values, number)


def box_triangles(low, high):
    corners = [[(high if i >> axis & 1 else low)[axis] for axis in range(3)] for i in range(8)]
    for a, b, c, d in ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)):
        yield corners[a], corners[b], corners[c]
        yield corners[a], corners[c], corners[d]


# Values of enumerations in rtcore_geometry.h, rtcore_buffer.h and rtcore_scene.h. A format also has its number of components.
TRIANGLE, CONE_LINEAR_CURVE, SPHERE_POINT, ORIENTED_DISC_POINT = 0, 15, 50, 52
INDEX, VERTEX, NORMAL = 0, 1, 3
FORMATS = {"I": 0x5000, "f": 0x9000}
QUALITY_HIGH, FLAG_ROBUST, INVALID_ID = 2, 4, 2**32 - 1
RAY_HIT = struct.Struct("9f3I5f3I")  # struct RTCRayHit


class Handle(ctypes.c_void_p):
    """An object of Embree. ctypes keeps results of a subclass as pointers."""


class Embree:
    """Embree by its C interface, which returns the object and its distance for single rays."""
    takes_starts = tells_distance = is_cheap = has_boxes_of_triangles = True

    def __init__(self, is_robust):
        self.flags = FLAG_ROBUST * is_robust
        self.name = "Embree" if is_robust else "Embree without its robust flag"
        self.version = "Embree " + version_of("libembree3-3")

    def is_here(self):
        try:
            self.library = ctypes.CDLL("libembree3.so.3")
        except OSError:
            return False
        for name in "rtcNewDevice", "rtcNewScene", "rtcNewGeometry", "rtcSetNewGeometryBuffer":
            getattr(self.library, name).restype = Handle
        return True

    @staticmethod
    def geometries(parts):
        """Returns the types of an object's geometries and their buffers. All triangles form one mesh."""
        found, vertices, triangles = [], {}, []
        for kind, body in parts:
            if kind == "sphere":
                found.append((SPHERE_POINT, [(VERTEX, "f", [[*body["center"], body["radius"]]])]))
            elif kind == "disc":
                found.append((ORIENTED_DISC_POINT, [(VERTEX, "f", [[*body["center"], body["radius"]]]), (NORMAL, "f", [body["normal"]])]))
            elif kind in ("cylinder", "cone") and "from" in body:
                first, last = body["radius"] if kind == "cone" else [body["radius"]] * 2
                found.append((CONE_LINEAR_CURVE, [(VERTEX, "f", [[*body["from"], first], [*body["to"], last]]), (INDEX, "I", [[0]])]))
            elif kind in ("triangle", "box"):
                corners = [body["vertices"]] if kind == "triangle" else box_triangles(body["min"], body["max"])
                triangles += [[vertices.setdefault(tuple(place), len(vertices)) for place in three] for three in corners]
            else:
                raise NotModelled(f"has no {'infinite ' * (kind == 'cylinder')}{kind}")
        return found + [(TRIANGLE, [(VERTEX, "f", list(vertices)), (INDEX, "I", triangles)])] * bool(triangles)

    def trace(self, objects, rays):
        embree, owners = self.library, {}
        device = embree.rtcNewDevice(b"threads=1")
        scene = embree.rtcNewScene(device)
        embree.rtcSetSceneBuildQuality(scene, QUALITY_HIGH)
        embree.rtcSetSceneFlags(scene, self.flags)
        for index, parts in enumerate(objects):
            for kind, buffers in self.geometries(parts):
                geometry = embree.rtcNewGeometry(device, kind)
                for use, letter, items in buffers:
                    content = array(letter, itertools.chain.from_iterable(items)).tobytes()
                    target = embree.rtcSetNewGeometryBuffer(geometry, use, 0, FORMATS[letter] + len(items[0]),
                                                            ctypes.c_size_t(4 * len(items[0])), ctypes.c_size_t(len(items)))
                    ctypes.memmove(target, content, len(content))
                embree.rtcCommitGeometry(geometry)
                owners[embree.rtcAttachGeometry(scene, geometry)] = index
                embree.rtcReleaseGeometry(geometry)
        embree.rtcCommitScene(scene)
        memory = ctypes.create_string_buffer(RAY_HIT.size + 16)
        ray_hit = (ctypes.c_char * RAY_HIT.size).from_buffer(memory, -ctypes.addressof(memory) % 16)  # aligned
        context = ctypes.create_string_buffer(struct.pack("IPI", 0, 0, INVALID_ID))  # as rtcInitIntersectContext sets it
        answers = []
        for origin, direction, start in rays:
            RAY_HIT.pack_into(ray_hit, 0, *origin, start, *direction, 0, math.inf, INVALID_ID, 0, 0, *[0] * 5, *[INVALID_ID] * 3)
            embree.rtcIntersect1(scene, context, ray_hit)
            numbers = RAY_HIT.unpack(ray_hit)
            answers.append(None if numbers[18] == INVALID_ID else (owners[numbers[18]], numbers[8]))
        embree.rtcReleaseScene(scene)
        embree.rtcReleaseDevice(device)
        return answers


class Glint:
    """Results from images alone, because glint verify reports those of rays."""

    def __init__(self, program, precision):
        self.program, self.precision, self.name = program, precision, f"glint {precision}"

    def render(self, scene, image, size):
        command = [self.program, "render", scene, "-o", image, "--quiet", "--precision", self.precision]
        command += ["--size", "{}x{}".format(*size), "--transfer", "none"]
        subprocess.run(command, capture_output=True, check=True)


def pixel_object(path):
    """Returns the object that the color of a PPM of one pixel encodes, as (index, None), or None for a miss."""
    code = path.read_bytes()[-3]
    return None if code == 0 else (code - 1, None)


class Povray:
    name = "POV-Ray"
    takes_starts = tells_distance = is_cheap = has_boxes_of_triangles = False

    def __init__(self):
        self.version = "POV-Ray " + version_of("povray")

    def is_here(self):
        return shutil.which("povray") is not None

    @staticmethod
    def vector(values):
        """Returns a vector with its coordinates rotated by one place, because POV-Ray's tori lie around y and ours around z."""
        return vector([values[1], values[2], values[0]], number)

    SHAPES = {
        "sphere": "sphere {{ {center}, {radius}", "plane": "plane {{ {normal}, 0 translate {point}",
        "disc": "disc {{ {center}, {normal}, {radius}", "box": "box {{ {min}, {max}",
        "torus": "torus {{ {major}, {minor} sturm translate {center}", "cylinder": "cylinder {{ {from}, {to}, {radius}",
    }

    def part(self, kind, body):
        v = self.vector
        if kind == "triangle":
            return "triangle { " + ", ".join(map(v, body["vertices"]))
        if kind == "cone":
            (a, b), (start, end) = body["radius"], (v(body["from"]), v(body["to"]))
            return f"cone {{ {start}, {a!r}, {end}, {b!r}"
        if kind == "cylinder" and "from" not in body:
            assert body["axis"] == [0, 0, 1] and not any(body["point"]), "only cylinders around z are written here"
            return f"quadric {{ {v([1, 1, 0])}, 0, 0, {-body['radius'] ** 2!r}"
        return self.SHAPES[kind].format(**{key: v(value) if isinstance(value, list) else repr(value) for key, value in body.items()})

    def trace(self, objects, rays):
        """Traces all rays in one run, each as a frame of an animation."""
        if len(rays) == 1:  # one frame is not an animation
            return self.trace(objects, rays * 2)[:1]
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            scene = ["#version 3.7; global_settings { assumed_gamma 1 }"]
            for name, place in (("Origin", 0), ("Direction", 1)):
                values = ", ".join(self.vector(ray[place]) for ray in rays)
                scene.append(f"#declare {name} = array[{len(rays)}] {{ {values} }}")
            scene.append("camera { perspective location Origin[frame_number - 1] direction Direction[frame_number - 1]")
            scene.append("right <0, 0, 1e-9> up <1e-9, 0, 0> }")
            for index, parts in enumerate(objects):
                look = f"pigment {{ rgb <{index + 1.25}/255, 0, 0> }} finish {{ ambient 1 diffuse 0 }}"
                if len(parts) > 1:
                    scene.append("union { " + " ".join(self.part(*part) + " }" for part in parts) + look + " }")
                else:
                    scene.append(self.part(*parts[0]) + " " + look + " }")
            (folder / "scene.pov").write_text("\n".join(scene))
            povray([f"+I{folder}/scene.pov", f"+O{folder}/ray.ppm", "+W1", "+H1", "+KFI1", f"+KFF{len(rays)}"])
            digits = len(str(len(rays)))
            return [pixel_object(folder / f"ray{i + 1:0{digits}}.ppm") for i in range(len(rays))]


def povray(options):
    command = ["povray", "+FP", "-D", "-V", "-A", "+WT1", "File_Gamma=1.0", *options]
    subprocess.run(command, capture_output=True, check=True)


class Tachyon:
    name = "Tachyon"
    takes_starts = tells_distance = is_cheap = has_boxes_of_triangles = False

    def __init__(self):
        self.version = "Tachyon " + version_of("tachyon-bin-nox")

    def is_here(self):
        return shutil.which("tachyon") is not None

    def part(self, kind, body, look):
        v = triple
        if kind == "sphere":
            return f"Sphere Center {v(body['center'])} Rad {body['radius']!r} {look}\n"
        if kind == "plane":
            return f"Plane Center {v(body['point'])} Normal {v(body['normal'])} {look}\n"
        if kind == "disc":
            return self.ring(body["center"], body["normal"], body["radius"], look)
        if kind == "box":
            return f"Box Min {v(body['min'])} Max {v(body['max'])} {look}\n"
        if kind == "triangle":
            a, b, c = map(v, body["vertices"])
            return f"Tri V0 {a} V1 {b} V2 {c} {look}\n"
        if kind == "cylinder" and "from" in body:
            axis = [b - a for a, b in zip(body["from"], body["to"])]
            side = f"FCylinder Base {v(body['from'])} Apex {v(body['to'])} Rad {body['radius']!r} {look}\n"
            return side + "".join(self.ring(body[end], axis, body["radius"], look) for end in ("from", "to"))
        if kind == "cylinder":
            return f"Cylinder Center {v(body['point'])} Axis {v(body['axis'])} Rad {body['radius']!r} {look}\n"
        raise NotModelled(f"has no {kind}")

    @staticmethod
    def ring(center, normal, radius, look):
        return f"Ring Center {triple(center)} Normal {triple(normal)} Inner 0 Outer {radius!r} {look}\n"

    def trace(self, objects, rays):
        scene = ""
        for index, parts in enumerate(objects):
            code = (index + 1.25) / 255
            look = f"Texture Ambient 1 Diffuse 0 Specular 0 Opacity 1 Color {code} 0 0 TexFunc 0"
            scene += "".join(self.part(kind, body, look) for kind, body in parts)
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            return [self.trace_one(folder, scene, *ray[:2]) for ray in rays]

    @staticmethod
    def trace_one(folder, scene, origin, direction):
        up = min(((abs(x), k) for k, x in enumerate(direction)))[1]
        # the pixel's ray passes through the frustum's upper right corner, which is the middle of the view
        head = scene_head((1, 1), (origin, direction, [k == up for k in range(3)], [-1e-9, 0, -1e-9, 0]), written=triple)
        (folder / "scene").write_text(head + "\n" + scene + "End_Scene\n")
        tachyon([folder / "scene", "-o", folder / "ray.ppm"])
        return pixel_object(folder / "ray.ppm")


def tachyon(options):
    command = ["tachyon", *options, "-numthreads", "1", "-format", "PPM", "-shade_phong"]
    subprocess.run(command, capture_output=True, check=True)


def version_of(package):
    run = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", package], capture_output=True, text=True)
    return run.stdout or "of unknown version"
