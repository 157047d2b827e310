"""Reads an NFF file (Eric Haines, Standard Procedural Databases) as glint does (docs/scene-format.md)."""
import ctypes
import functools
import pathlib
import subprocess
import tempfile

from scene import Mesh, Scene

ROOT = pathlib.Path(__file__).resolve().parents[2]
TRIANGULATION = "host/scene/polygon.c", "host/base/memory.c", "host/base/array.c", "host/base/fault.c"


class PolygonTriangles(ctypes.Structure):
    _fields_ = [("items", ctypes.POINTER(ctypes.c_uint32 * 3)), ("count", ctypes.c_size_t), ("capacity", ctypes.c_size_t)]


@functools.cache
def triangulation():
    """Builds and loads glint's triangulation, so that all programs have the same triangles."""
    with tempfile.TemporaryDirectory() as folder:
        library = pathlib.Path(folder) / "polygon.so"
        subprocess.run(["cc", "-std=gnu11", "-O2", "-ffp-contract=off", "-shared", "-fPIC", f"-I{ROOT}",
                        *(ROOT / source for source in TRIANGULATION), "-lm", "-o", library], check=True)
        return ctypes.CDLL(library), PolygonTriangles()


def triangles_of(corners):
    library, triangles = triangulation()
    flat = (ctypes.c_double * (3 * len(corners)))(*(part for corner in corners for part in corner))
    library.polygon_triangulate(flat, ctypes.c_size_t(len(corners)), ctypes.byref(triangles))
    return [list(triangles.items[i]) for i in range(triangles.count)]


def add_polygon(scene, material, corners):
    """Adds a polygon to the last mesh, or to a new one if its material or use of normals differs. Corners may have normals."""
    places, normals = [corner[:3] for corner in corners], [corner[3:] for corner in corners if corner[3:]]
    last = scene.meshes[-1] if scene.meshes else None
    if not last or last.material != material or bool(last.normals) != bool(normals):
        last = Mesh([], [], [], material)
        scene.meshes.append(last)
    first = len(last.vertices)
    last.vertices += places
    last.normals += normals
    last.faces += [[first + corner for corner in triangle] for triangle in triangles_of(places)]


def material_of(numbers):
    red, green, blue, diffuse, specular, shine, transmission, ior = numbers
    return {"color": [red, green, blue], "ambient": diffuse, "diffuse": diffuse, "specular": specular, "reflection": specular,
            "shininess": shine, "transmission": transmission, "ior": ior}


def finish_lights(scene):
    """Sets the ambient light, and each light without a color, to the intensity sqrt(n) / 2n, where n is the number of lights."""
    if scene.lights:
        white = [len(scene.lights) ** -0.5 / 2] * 3
        scene.ambient = white
        scene.lights = [(place, color or white) for place, color in scene.lights]


def read_nff(path):
    scene = Scene({}, [0, 0, 0], [0, 0, 0], [], {})
    material = None
    lines = (line.split("#")[0].split() for line in pathlib.Path(path).read_text().splitlines())
    lines = iter([words for words in lines if words])
    for name, *words in lines:
        if name == "v":
            view = {key: numbers for key, *numbers in (next(lines) for _ in range(6))}
            for key, there in ("from", "position"), ("at", "look_at"), ("up", "up"):
                scene.camera[there] = list(map(float, view[key]))
            scene.camera["fov"] = float(view["angle"][0])
            continue
        numbers = list(map(float, words))
        if name == "b":
            scene.background = numbers
        elif name == "l":
            scene.lights.append((numbers[:3], numbers[3:]))
        elif name == "f":
            material = f"m{len(scene.materials)}"
            scene.materials[material] = material_of(numbers)
        elif name == "s":
            scene.spheres.append((numbers[:3], numbers[3], material))
        elif name == "c":
            while len(numbers) < 8:
                numbers += map(float, next(lines))
            scene.cones.append((numbers[:3], numbers[3], numbers[4:7], numbers[7], material))
        elif name in ("p", "pp"):
            add_polygon(scene, material, [list(map(float, next(lines))) for _ in range(int(words[0]))])
        else:
            raise ValueError(f"unknown element '{name}'")
    finish_lights(scene)
    return scene
