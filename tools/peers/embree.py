"""Writes a scene for tools/peers/embree, a renderer on Embree (Debian package libembree-dev), and runs it."""
import pathlib

from scene import NotModelled, cross, triple, unit


def write_scene(scene, path, _size=None):
    if scene.cones:
        raise NotModelled("no cones and cylinders")
    if any(material.get(key, 0) > 0 for material in scene.materials.values() for key in ("reflection", "transmission")):
        raise NotModelled("no mirrors and no glass")
    forward = unit(scene.view())
    right = unit(cross(forward, scene.up()))
    names = {name: index for index, name in enumerate(scene.materials)}
    with open(path, "w") as file:
        write = file.write
        write(f"camera 1\n{triple(scene.camera['position'])} {triple(forward)} {triple(right)} "
              f"{triple(cross(right, forward))} {scene.half_tangent():.9g}\n{triple(scene.background)}\n")
        write(f"lights {len(scene.lights) + len(scene.suns)}\n")
        for position, color in scene.lights:
            write(f"{triple(position)} {triple(color)} 0\n")
        for direction, color in scene.suns:
            write(f"{triple([-part for part in direction])} {triple(color)} 1\n")
        write(f"materials {len(names)}\n")
        for material in scene.materials.values():
            color = material.get("color", [1, 1, 1])
            ambient = [part * light * material.get("ambient", 1) for part, light in zip(color, scene.ambient)]
            diffuse = [part * material.get("diffuse", 1) for part in color]
            write(f"{triple(ambient)} {triple(diffuse)} {material.get('specular', 0)} {material.get('shininess', 32)}\n")
        write(f"planes {len(scene.planes)}\n")
        for point, normal, material in scene.planes:
            write(f"{triple(point)} {triple(unit(normal))} {names[material]}\n")
        write(f"spheres {len(scene.spheres)}\n")
        for center, radius, material in scene.spheres:
            write(f"{triple(center)} {radius:.9g} {names[material]}\n")
        write(f"meshes {len(scene.meshes)}\n")
        for mesh in scene.meshes:
            for name, items in ("vertices", mesh.vertices), ("normals", mesh.normals):
                write(f"{name} {len(items)}\n")
                for item in items:
                    write(triple(item) + "\n")
            write(f"faces {len(mesh.faces)}\n")
            for face in mesh.faces:
                write("%d %d %d\n" % tuple(face))
            write(f"{names[mesh.material]}\ninstances {len(mesh.instances)}\n")
            for columns in mesh.instances:
                write(" ".join(map(triple, columns)) + "\n")
