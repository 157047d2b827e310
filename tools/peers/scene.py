"""Reads YAML scenes of spheres, planes, meshes and their instances, for the writers of other programs' formats."""
import math
import pathlib
import re
from dataclasses import dataclass, field

import yaml

SPHERE = re.compile(r"^  - sphere: {center: \[([^,]+), ([^,]+), ([^\]]+)\], radius: ([^,]+), material: (\w+)}\n", re.M)


class NotModelled(Exception):
    """Raised for a feature that a program does not have."""


@dataclass
class Mesh:
    vertices: list
    faces: list     # triples of vertex indices
    normals: list   # one per vertex, or empty for flat shading
    material: str
    instances: list = field(default_factory=list)  # four columns of a 3x4 matrix each; replace the mesh itself


@dataclass
class Scene:
    camera: dict
    background: list
    ambient: list
    lights: list    # (position, color)
    materials: dict
    spheres: list = field(default_factory=list)  # (center, radius, material)
    planes: list = field(default_factory=list)   # (point, normal, material)
    meshes: list = field(default_factory=list)
    suns: list = field(default_factory=list)     # directional lights: (direction of travel, color)
    cones: list = field(default_factory=list)    # without caps: (from, its radius, to, its radius, material)

    def half_tangent(self):
        """Returns the tangent of half the vertical field of view."""
        return math.tan(math.radians(self.camera.get("fov", 50)) / 2)

    def view(self):
        return subtract(self.camera["look_at"], self.camera["position"])

    def up(self):
        return self.camera.get("up", [0, 1, 0])


def subtract(a, b):
    return [p - q for p, q in zip(a, b)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(p * q for p, q in zip(a, b))


def unit(a):
    length = math.hypot(*a)
    return [part / length for part in a] if length else [0, 0, 0]


def triple(values, number="{:.9g}".format, between=" "):
    return between.join(map(number, values))


def rotation(degrees):
    """Returns the matrix of rotations about x, then y, then z."""
    (sx, cx), (sy, cy), (sz, cz) = ((math.sin(a), math.cos(a)) for a in map(math.radians, degrees))
    return [[cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
            [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
            [-sy, cy * sx, cy * cx]]


def smooth_normals(vertices, faces):
    """Returns each vertex's mean of the normals of its faces, weighted by their angles at the vertex."""
    normals = [[0.0, 0.0, 0.0] for _ in vertices]
    for face in faces:
        corners = [vertices[i] for i in face]
        normal = unit(cross(subtract(corners[1], corners[0]), subtract(corners[2], corners[0])))
        for k in range(3):
            a, b = subtract(corners[(k + 1) % 3], corners[k]), subtract(corners[(k + 2) % 3], corners[k])
            angle = math.atan2(math.hypot(*cross(a, b)), dot(a, b))
            total = normals[face[k]]
            for axis in range(3):
                total[axis] += angle * normal[axis]
    return [unit(normal) for normal in normals]


def read_mesh(keys, folder):
    """Reads an OBJ of triangles without normals."""
    transform = keys.get("transform", {})
    scale = transform.get("scale", 1)
    scale = scale if isinstance(scale, list) else [scale] * 3
    turn, move = rotation(transform.get("rotate", [0, 0, 0])), transform.get("translate", [0, 0, 0])
    vertices, faces = [], []
    with open(folder / keys["file"]) as lines:
        for line in lines:
            words = line.split()
            if words[:1] == ["v"]:
                scaled = [float(word) * by for word, by in zip(words[1:4], scale)]
                vertices.append([dot(row, scaled) + by for row, by in zip(turn, move)])
            elif words[:1] == ["f"] and len(words) == 4:
                faces.append([int(word.split("/")[0]) - 1 for word in words[1:]])
            elif words[:1] in (["f"], ["vn"]):
                raise ValueError(f"{keys['file']}: only triangles without normals can be compared")
    normals = smooth_normals(vertices, faces) if keys.get("smooth") else []
    return Mesh(vertices, faces, normals, keys["material"])


def read_definition(group, folder):
    refuse_other_keys("a definition", group, ["objects"])
    if [list(item) for item in group["objects"]] != [["mesh"]]:
        raise ValueError("only definitions of one mesh can be compared")
    return read_mesh(group["objects"][0]["mesh"], folder)


def read_instance(keys):
    """Returns the four columns of its matrix, 3x4. It turns normals, because its scale is uniform."""
    refuse_other_keys("an instance", keys, ["of", "transform"])
    columns = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]]
    steps = keys.get("transform", [])
    for step in steps if isinstance(steps, list) else [steps]:
        refuse_other_keys("an instance's transform", step, ["scale", "rotate", "translate"])
        scale, degrees = step.get("scale", 1), step.get("rotate", [0, 0, 0])
        if isinstance(scale, list) or scale <= 0 or not isinstance(degrees, list):
            raise ValueError("only instances with one positive scale and rotations about x, y and z can be compared")
        turn = rotation(degrees)
        columns = [[scale * dot(row, column) for row in turn] for column in columns]
        columns[3] = [part + by for part, by in zip(columns[3], step.get("translate", [0, 0, 0]))]
    return columns


def refuse_other_keys(what, mapping, known):
    for key in mapping:
        if key not in known:
            raise ValueError(f"{what} with '{key}' cannot be compared, only with {', '.join(known)}")


def read_scene(path):
    path, quick = pathlib.Path(path), []

    def add_sphere(match):
        *center, radius = map(float, match.groups()[:4])
        quick.append((center, radius, match[5]))
        return ""

    data = yaml.safe_load(SPHERE.sub(add_sphere, path.read_text()))  # PyYAML needs minutes for a million spheres
    refuse_other_keys("a camera", data["camera"], ["position", "look_at", "up", "fov"])
    for material in data["materials"].values():
        refuse_other_keys("a material", material, ["color", "ambient", "diffuse", "specular", "shininess", "reflection"])
    scene = Scene(data["camera"], data.get("background", [0, 0, 0]), data.get("ambient", [0, 0, 0]), [], data["materials"], quick)
    for light in data["lights"]:
        refuse_other_keys("a light", light, ["point", "directional"])
        ((kind, keys),) = light.items()
        color = [part * keys.get("intensity", 1) for part in keys.get("color", [1, 1, 1])]
        if kind == "point":
            scene.lights.append((keys["position"], color))
        else:
            scene.suns.append((keys["direction"], color))
    definitions = {name: read_definition(group, path.parent) for name, group in data.get("define", {}).items()}
    for item in data["objects"] or []:  # null if all are spheres of one line
        ((kind, keys),) = item.items()
        if kind == "sphere":
            scene.spheres.append((keys["center"], keys["radius"], keys["material"]))
        elif kind == "plane":
            scene.planes.append((keys["point"], keys["normal"], keys["material"]))
        elif kind == "mesh":
            scene.meshes.append(read_mesh(keys, path.parent))
        elif kind == "instance":
            mesh = definitions[keys["of"]]
            if not mesh.instances:
                scene.meshes.append(mesh)
            mesh.instances.append(read_instance(keys))
        else:
            raise ValueError(f"only spheres, planes, meshes and instances can be compared, not a {kind}")
    return scene
