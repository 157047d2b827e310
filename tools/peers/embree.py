"""Writes a scene as tools/peers/embree reads it, and runs that: a renderer on Embree (Debian package libembree-dev)."""
import pathlib

from scene import cross, triple, unit


def write_scene(scene, path, _size=None):
    forward = unit(scene.view())
    right = unit(cross(forward, scene.up()))
    names = {name: index for index, name in enumerate(scene.materials)}
    with open(path, "w") as file:
        write = file.write
        write(f"camera 1\n{triple(scene.camera['position'])} {triple(forward)} {triple(right)} "
              f"{triple(cross(right, forward))} {scene.half_tangent():.9g}\n{triple(scene.background)}\n")
        write(f"lights {len(scene.lights)}\n")
        for position, color in scene.lights:
            write(f"{triple(position)} {triple(color)}\n")
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
            write(f"vertices {len(mesh.vertices)}\n")
            for vertex, normal in zip(mesh.vertices, mesh.normals):
                write(f"{triple(vertex)} {triple(normal)}\n")
            write(f"faces {len(mesh.faces)}\n")
            for face in mesh.faces:
                write("%d %d %d\n" % tuple(face))
            write(f"{names[mesh.material]}\n")
