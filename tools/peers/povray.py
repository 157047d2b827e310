"""Writes a scene in POV-Ray's language (version 3.7, Debian package povray) and runs it."""
import re

from scene import cross, triple, unit

SETTINGS = "#version 3.7;\nglobal_settings { assumed_gamma 1 ambient_light rgb 1 max_trace_level 6 adc_bailout 0 }\n"


def vector(values, *number):
    return f"<{triple(values, *number, between=',')}>"


def material_text(name, material, ambient):
    """Returns a material's text. POV-Ray scales ambient and diffuse light of a transparent one by its opaque fraction."""
    transmission = material.get("transmission", 0)
    opaque = 1 - transmission
    finish = [part * material.get("ambient", 1) / opaque for part in ambient]
    return (f"#declare M_{name} = material {{ texture {{ pigment {{ rgb {vector(material.get('color', [1, 1, 1]))} "
            f"transmit {transmission} }} finish {{ ambient rgb {vector(finish)} "
            f"diffuse {material.get('diffuse', 1) / opaque:.9g} phong {material.get('specular', 0)} "
            f"phong_size {material.get('shininess', 32)} reflection {material.get('reflection', 0)} }} }} "
            f"interior {{ ior {material.get('ior', 1.5)} }} }}\n")


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


def write_shapes(write, scene, end):
    """Writes each shape, ended by `end` of its material's name. Omits those for which `end` returns None."""
    def write_shape(text, name):
        if end(name) is not None:
            write(f"{text} {end(name)}\n")

    for point, normal, name in scene.planes:
        away = sum(p * n for p, n in zip(point, unit(normal)))
        write_shape(f"plane {{ {vector(unit(normal))}, {away:.9g}", name)
    for center, radius, name in scene.spheres:
        write_shape(f"sphere {{ {vector(center)}, {radius:.9g}", name)
    for start, radius, to, to_radius, name in scene.cones:
        write_shape(f"cone {{ {vector(start)}, {radius:.9g}, {vector(to)}, {to_radius:.9g} open" if radius != to_radius else
                    f"cylinder {{ {vector(start)}, {vector(to)}, {radius:.9g} open", name)
    for mesh in scene.meshes:
        if end(mesh.material) is None:
            continue
        write("#declare Shared = " if mesh.instances else "")
        write_mesh(write, mesh)
        write("}\n" if mesh.instances else f"{end(mesh.material)}\n")
        for columns in mesh.instances:
            write_shape(f"object {{ Shared matrix {vector(sum(columns, []))}", mesh.material)


def camera_text(scene, size, lens=""):
    view = unit(scene.view())
    right = unit(cross(view, scene.up()))
    up = cross(right, view)
    tall = 2 * scene.half_tangent()
    return (f"camera {{ location {vector(scene.camera['position'])} direction {vector(view)} "
            f"right {vector([tall * size[0] / size[1] * part for part in right])} "
            f"up {vector([tall * part for part in up])} {lens}}}\n")


def write_scene(scene, path, size):
    with open(path, "w") as file:
        write = file.write
        write(f"{SETTINGS}background {{ rgb {vector(scene.background)} }}\n{camera_text(scene, size)}")
        for position, color in scene.lights:
            write(f"light_source {{ {vector(position)} rgb {vector(color)} }}\n")
        for direction, color in scene.suns:
            write(f"light_source {{ {vector([-1e6 * part for part in unit(direction)])} rgb {vector(color)} parallel "
                  "point_at <0, 0, 0> }\n")
        for name, material in scene.materials.items():
            write(material_text(name, material, scene.ambient))
        glass = {name for name, material in scene.materials.items() if material.get("transmission", 0) > 0}
        write_shapes(write, scene, lambda name: f"material {{ M_{name} }} {'no_shadow ' * (name in glass)}}}")
        # In NFF, glass casts the shadow of an opaque object. In POV-Ray a second, invisible object casts it.
        write_shapes(write, scene, lambda name: "no_image no_reflection }" if name in glass else None)


def command(scene_path, image, size):
    return ["povray", f"+I{scene_path}", f"+O{image}", f"+W{size[0]}", f"+H{size[1]}", "+FP", "-D", "-V", "-A",
            "File_Gamma=1.0"]


def trace_seconds(run):
    """Returns the time that the program reports."""
    return float(re.search(r"Trace Time:.*\(([0-9.]+) seconds\)", run.stderr).group(1))
