"""Runs tools/peers/embree, a renderer on Embree (Debian package libembree-dev), and writes its scenes."""
import itertools
import os
from array import array

from runs import run_once
from scene import NotModelled, cross, unit


def run(program, description, *options):
    """Runs the renderer on all cores. Its threads sleep between frames, because spinning would count as processor time."""
    environment = {**os.environ, "OMP_WAIT_POLICY": "passive"}
    environment.pop("OMP_NUM_THREADS", None)
    return run_once([program, description, *options], environment)


def write_scene(scene, path, _size=None):
    """Writes arrays of floats or ints, each after its number of items, in the order of description_read in description.c."""
    if scene.cones:
        raise NotModelled("no cones and cylinders")
    if any(material.get(key, 0) > 0 for material in scene.materials.values() for key in ("reflection", "transmission")):
        raise NotModelled("no mirrors and no glass")
    forward = unit(scene.view())
    right = unit(cross(forward, scene.up()))
    names = {name: index for index, name in enumerate(scene.materials)}

    with open(path, "wb") as file:
        def put(kind, items):
            array("Q", [len(items)]).tofile(file)
            array(kind, itertools.chain.from_iterable(items)).tofile(file)

        def put_materials(shapes):
            put("i", [[names[material]] for *_, material in shapes])

        put("f", [[*scene.camera["position"], *forward, *right, *cross(right, forward), scene.half_tangent(), *scene.background]])
        put("f", [[*position, *color, 1] for position, color in scene.lights] +
            [[*(-part for part in direction), *color, 0] for direction, color in scene.suns])
        materials = []
        for material in scene.materials.values():
            color = material.get("color", [1, 1, 1])
            materials.append([*(part * light * material.get("ambient", 1) for part, light in zip(color, scene.ambient)),
                              *(part * material.get("diffuse", 1) for part in color),
                              material.get("specular", 0), material.get("shininess", 32)])
        put("f", materials)
        put("f", [[*point, *unit(normal)] for point, normal, _ in scene.planes])
        put_materials(scene.planes)
        put("f", [[*center, radius] for center, radius, _ in scene.spheres])
        put_materials(scene.spheres)
        put_materials([[mesh.material] for mesh in scene.meshes])
        for mesh in scene.meshes:
            put("f", mesh.vertices)
            put("f", mesh.normals)
            put("i", mesh.faces)
            put("f", [sum(columns, []) for columns in mesh.instances])
