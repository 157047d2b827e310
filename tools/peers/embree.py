"""Writes a scene as tools/peers/embree reads it, and runs that: a renderer on Embree (Debian package libembree-dev)."""
import pathlib

from scene import NotModelled, cross, subtract, triple, unit


def flat(mesh):
    """Three vertices of its own for each face, all with the face's normal."""
    vertices = [mesh.vertices[corner] for face in mesh.faces for corner in face]
    normals = []
    for at in range(0, len(vertices), 3):
        a, b, c = vertices[at:at + 3]
        normals += [unit(cross(subtract(b, a), subtract(c, a)))] * 3
    return vertices, normals, [range(at, at + 3) for at in range(0, len(vertices), 3)]


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
            vertices, normals, faces = (mesh.vertices, mesh.normals, mesh.faces) if mesh.normals else flat(mesh)
            write(f"vertices {len(vertices)}\n")
            for vertex, normal in zip(vertices, normals):
                write(f"{triple(vertex)} {triple(normal)}\n")
            write(f"faces {len(faces)}\n")
            for face in faces:
                write("%d %d %d\n" % tuple(face))
            write(f"{names[mesh.material]}\n")
