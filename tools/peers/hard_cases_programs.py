"""Traces rays with other programs, for tools/peers/hard-cases."""
import pathlib
import shutil
import subprocess
import tempfile

SOURCE = pathlib.Path(__file__).with_name("hard-cases.c")


class NotModelled(Exception):
    """Raised for a shape that the program does not have."""


def triple(values, between=" "):
    return between.join(repr(float(x)) for x in values)


def box_triangles(low, high):
    corners = [[(high if i >> axis & 1 else low)[axis] for axis in range(3)] for i in range(8)]
    for a, b, c, d in ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)):
        yield corners[a], corners[b], corners[c]
        yield corners[a], corners[c], corners[d]


class Embree:
    takes_starts = tells_distance = is_cheap = has_boxes_of_triangles = True

    def __init__(self, folder, flag):
        self.program, self.flag = pathlib.Path(folder) / "hard-cases", flag
        self.name = "Embree" if flag == "robust" else "Embree without its robust flag"
        self.version = "Embree " + version_of("libembree-dev")

    def is_here(self):
        if not self.program.exists():
            command = ["cc", "-std=c11", "-O2", SOURCE, "-lembree3", "-o", self.program]
            return subprocess.run(command, capture_output=True).returncode == 0
        return True

    def part(self, kind, body):
        def line(word, *vectors):
            return word + " " + " ".join(float(x).hex() for vector in vectors for x in vector)

        if kind == "sphere":
            return [line("sphere", body["center"], [body["radius"]])]
        if kind == "disc":
            return [line("disc", body["center"], body["normal"], [body["radius"]])]
        if kind == "triangle":
            return [line("triangle", *body["vertices"])]
        if kind == "box":
            return [line("triangle", *corners) for corners in box_triangles(body["min"], body["max"])]
        if kind in ("cylinder", "cone") and "from" in body:
            radii = body["radius"] if kind == "cone" else [body["radius"]] * 2
            return [line("cone", body["from"], radii[:1], body["to"], radii[1:])]
        raise NotModelled(f"has no {'infinite ' * (kind == 'cylinder')}{kind}")

    def trace(self, objects, rays):
        lines = []
        for parts in objects:
            lines.append("object")
            for kind, body in parts:
                lines += self.part(kind, body)
        for origin, direction, start in rays:
            lines.append("ray " + " ".join(float(x).hex() for x in [*origin, *direction, start]))
        command, text = [self.program, self.flag], "\n".join(lines)
        run = subprocess.run(command, input=text, capture_output=True, text=True, check=True)
        answers = [line.split() for line in run.stdout.splitlines()]
        return [None if words == ["-"] else (int(words[0]), float(words[1])) for words in answers]


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
        return "<" + triple([values[1], values[2], values[0]], ", ") + ">"

    def part(self, kind, body):
        v = self.vector
        if kind == "sphere":
            return f"sphere {{ {v(body['center'])}, {body['radius']!r}"
        if kind == "plane":
            return f"plane {{ {v(body['normal'])}, 0 translate {v(body['point'])}"
        if kind == "disc":
            return f"disc {{ {v(body['center'])}, {v(body['normal'])}, {body['radius']!r}"
        if kind == "box":
            return f"box {{ {v(body['min'])}, {v(body['max'])}"
        if kind == "triangle":
            return "triangle { " + ", ".join(map(v, body["vertices"]))
        if kind == "torus":
            return f"torus {{ {body['major']!r}, {body['minor']!r} sturm translate {v(body['center'])}"
        if kind == "cone":
            (a, b), (start, end) = body["radius"], (v(body["from"]), v(body["to"]))
            return f"cone {{ {start}, {a!r}, {end}, {b!r}"
        if "from" in body:
            return f"cylinder {{ {v(body['from'])}, {v(body['to'])}, {body['radius']!r}"
        assert body["axis"] == [0, 0, 1] and not any(body["point"]), "only cylinders around z are written here"
        return f"quadric {{ {v([1, 1, 0])}, 0, 0, {-body['radius'] ** 2!r}"

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
        head = (
            "Begin_Scene\nResolution 1 1\nCamera\nZoom 1\nAspectratio 1\nAntialiasing 0\nRaydepth 1\n"
            f"Center {triple(origin)}\nViewDir {triple(direction)}\n"
            f"UpDir {triple([float(k == up) for k in range(3)])}\n"
            "Frustum -1e-9 0 -1e-9 0\nEnd_Camera\nBackground 0 0 0\n"
        )
        (folder / "scene").write_text(head + scene + "End_Scene\n")
        tachyon([folder / "scene", "-o", folder / "ray.ppm"])
        return pixel_object(folder / "ray.ppm")


def tachyon(options):
    command = ["tachyon", *options, "-numthreads", "1", "-format", "PPM", "-shade_phong"]
    subprocess.run(command, capture_output=True, check=True)


def version_of(package):
    run = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", package], capture_output=True, text=True)
    return run.stdout or "of unknown version"
