"""Writes a scene in POV-Ray's language (version 3.7, Debian package povray) and runs it."""
import re

from scene import cross, unit


def vector(values):
    return "<" + ",".join(f"{value:.9g}" for value in values) + ">"


def texture(name, material, ambient):
    finish = [part * material.get("ambient", 1) for part in ambient]
    return (f"#declare {name} = texture {{ pigment {{ rgb {vector(material.get('color', [1, 1, 1]))} }} "
            f"finish {{ ambient rgb {vector(finish)} diffuse {material.get('diffuse', 1)} "
            f"phong {material.get('specular', 0)} phong_size {material.get('shininess', 32)} }} }}\n")


def write_list(write, name, texts):
    write(f"{name} {{ {len(texts)},\n")
    write(",\n".join(texts))
    write("\n}\n")


def write_mesh(write, mesh):
    write("mesh2 {\n")
    write_list(write, "vertex_vectors", [vector(vertex) for vertex in mesh.vertices])
    if mesh.normals:
        write_list(write, "normal_vectors", [vector(normal) for normal in mesh.normals])
    write_list(write, "face_indices", [vector(face) for face in mesh.faces])
    write(f"texture {{ T_{mesh.material} }} }}\n")


def write_scene(scene, path, size):
    view = unit(scene.view())
    right = unit(cross(view, scene.up()))
    up = cross(right, view)
    tall = 2 * scene.half_tangent()
    with open(path, "w") as file:
        write = file.write
        write("#version 3.7;\nglobal_settings { assumed_gamma 1 ambient_light rgb 1 max_trace_level 1 }\n"
              f"background {{ rgb {vector(scene.background)} }}\n"
              f"camera {{ location {vector(scene.camera['position'])} direction {vector(view)} "
              f"right {vector([tall * size[0] / size[1] * part for part in right])} "
              f"up {vector([tall * part for part in up])} }}\n")
        for position, color in scene.lights:
            write(f"light_source {{ {vector(position)} rgb {vector(color)} }}\n")
        for name, material in scene.materials.items():
            write(texture(f"T_{name}", material, scene.ambient))
        for point, normal, material in scene.planes:
            away = sum(p * n for p, n in zip(point, unit(normal)))
            write(f"plane {{ {vector(unit(normal))}, {away:.9g} texture {{ T_{material} }} }}\n")
        for center, radius, material in scene.spheres:
            write(f"sphere {{ {vector(center)}, {radius:.9g} texture {{ T_{material} }} }}\n")
        for mesh in scene.meshes:
            write_mesh(write, mesh)


def command(scene_path, image, size):
    return ["povray", f"+I{scene_path}", f"+O{image}", f"+W{size[0]}", f"+H{size[1]}", "+FP", "-D", "-V", "-A",
            "File_Gamma=1.0"]


def stage_seconds(_stdout, stderr):
    """What the program reports of its own time: (read, prepare, trace)."""
    def seconds(name):
        match = re.search(name + r" Time:.*\(([0-9.]+) seconds\)", stderr)
        return float(match.group(1)) if match else 0.0
    return seconds("Parse"), seconds("Bounding"), seconds("Trace")
