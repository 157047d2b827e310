"""Writes a scene in Tachyon's format (John Stone, Tachyon, Debian package tachyon) and runs it."""
import re

from scene import NotModelled, triple


def flipped(value):
    """Returns a value with x negated, because Tachyon's coordinates are left-handed."""
    if isinstance(value, (list, tuple)):
        if len(value) == 3 and not isinstance(value[0], (list, tuple)):
            return [-value[0], value[1], value[2]]
        return [flipped(part) for part in value]
    return value


def place(values):
    return triple(flipped(values))


def frustum(half_tangent, size):
    """Returns the image's left, right, bottom and top at a distance of 1, shifted by half a pixel to the left and down, because
    Tachyon's rays pass through the upper right corners of the pixels and those of the others through the centers."""
    half_pixel, right = half_tangent / size[1], half_tangent * size[0] / size[1]
    return [side - half_pixel for side in (-right, right, -half_tangent, half_tangent)]


def scene_head(size, camera, background=(0, 0, 0), written=triple):
    """Returns what precedes the lights. `camera` has the eye, view and up directions, left-handed, and the frustum. `written`
    writes a vector."""
    eye, view, up, sides = map(written, camera)
    return (f"Begin_Scene\nResolution {size[0]} {size[1]}\nCamera\nZoom 1\nAspectratio 1\nAntialiasing 0\nRaydepth 1\n"
            f"Center {eye}\nViewDir {view}\nUpDir {up}\nFrustum {sides}\nEnd_Camera\nBackground {written(background)}")


def texture(material, ambient):
    return (f"Ambient {ambient:.9g} Diffuse {material.get('diffuse', 1)} Specular {material.get('reflection', 0)} Opacity 1 "
            f"Phong Plastic {material.get('specular', 0)} Phong_size {material.get('shininess', 32)} "
            f"Color {triple(material.get('color', [1, 1, 1]))} TexFunc 0")


def write_mesh(write, mesh):
    places = [place(vertex) for vertex in mesh.vertices]
    normals = [place(normal) for normal in mesh.normals]
    for a, c, b in mesh.faces:  # mirroring reverses a triangle's winding
        corners = f"V0 {places[a]} V1 {places[b]} V2 {places[c]}"
        if normals:
            write(f"STri {corners} N0 {normals[a]} N1 {normals[b]} N2 {normals[c]} {mesh.material}\n")
        else:
            write(f"Tri {corners} {mesh.material}\n")


def write_scene(scene, path, size):
    if len(set(scene.ambient)) != 1:
        raise NotModelled("gray ambient light only")
    if any(start != end for _, start, _, end, _ in scene.cones):
        raise NotModelled("no cones")
    if any(material.get("transmission", 0) > 0 for material in scene.materials.values()):
        raise NotModelled("no refraction")
    if any(mesh.instances for mesh in scene.meshes):
        raise NotModelled("no instances")
    with open(path, "w") as file:
        write = file.write
        camera = [*map(flipped, (scene.camera["position"], scene.view(), scene.up())), frustum(scene.half_tangent(), size)]
        write(scene_head(size, camera, scene.background) + "\n")
        for position, color in scene.lights:
            write(f"Light Center {place(position)} Rad 0.01 Color {triple(color)}\n")
        for direction, color in scene.suns:
            write(f"Directional_Light Direction {place(direction)} Color {triple(color)}\n")
        for name, material in scene.materials.items():
            write(f"TexDef {name} {texture(material, scene.ambient[0] * material.get('ambient', 1))}\n")
        for point, normal, material in scene.planes:
            write(f"Plane Center {place(point)} Normal {place(normal)} {material}\n")
        for center, radius, material in scene.spheres:
            write(f"Sphere Center {place(center)} Rad {radius:.9g} {material}\n")
        for start, radius, end, _, material in scene.cones:
            write(f"FCylinder Base {place(start)} Apex {place(end)} Rad {radius:.9g} {material}\n")
        for mesh in scene.meshes:
            write_mesh(write, mesh)
        write("End_Scene\n")


def command(scene_path, image, size):
    """Returns the command. A depth of 6 counts the camera ray, so it equals glint's five bounces."""
    return ["tachyon", scene_path, "-res", str(size[0]), str(size[1]), "-shade_phong", "-raydepth", "6",
            "-format", "PPM", "-o", image]


def trace_seconds(run):
    """Returns the time that the program reports."""
    return float(re.search(r"Ray Tracing Time:\s*([0-9.]+)", run.stdout).group(1))
