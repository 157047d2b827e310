#!/usr/bin/env -S python3 -B
"""Reads glTF files, as meshes and as scenes. Tests every layout of numbers, nodes, materials, what is refused, and what is
named."""
import json
import math
import struct
from pathlib import Path
from unittest import skipUnless

from glint import TestCase, main, npy_read, png_bytes, write
from mesh_files import (
    BYTE, DAE, DAE_VIEW, FBX, FLOAT, SHORT, SQUARE, TWO_TRIANGLES, UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT, WHOLE, Gltf, formatted,
)

SAMPLE_MODELS = Path("/usr/share/assimp/models/glTF2")


def png(rows, color=2, *extra):
    """Returns an 8-bit image of values from 0 to 1, by default RGB, with extra chunks."""
    return png_bytes([bytes(int(255 * value) for pixel in row for value in pixel) for row in rows], color, *extra)


RED, GREEN, BLUE, WHITE = (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)
QUADRANTS = png([[RED] * 4 + [GREEN] * 4] * 4 + [[BLUE] * 4 + [WHITE] * 4] * 4)
# Normals: straight up, and tilted against u, against v and along v, by a cosine of 0.8.
FLAT, BACK, DOWN, UP = (0.502, 0.502, 1), (0.2, 0.502, 0.902), (0.502, 0.2, 0.902), (0.502, 0.8, 0.902)
NORMALS = png([[FLAT] * 4 + [BACK] * 4] * 4 + [[DOWN] * 4 + [UP] * 4] * 4)


class Test(TestCase):
    def checked(self, path, *warnings):
        """Returns what glint check reports. The warnings, and no others, must have these parts."""
        report = self.json(f"check --json {path}")
        texts = [warning["text"] for warning in report["warnings"]]
        self.assertEqual(len(texts), len(warnings), texts)
        for text, part in zip(texts, warnings):
            self.assertIn(part, text)
        return report

    def assert_square(self, path, low=(0, 0, 0), high=(1, 1, 0), triangles=2):
        report = self.checked(path)
        self.assertEqual(report["mesh_triangles"], triangles, path)
        for got, expected in ((report["bounds"]["min"], low), (report["bounds"]["max"], high)):
            for a, b in zip(got, expected):
                self.assertAlmostEqual(a, b, delta=1e-15, msg=path)

    def test_containers(self):
        gltf = Gltf()
        gltf.square()
        self.assert_square(gltf.write("binary.glb"))
        self.assert_square(gltf.write("text.gltf"))
        del gltf.json["buffers"]
        Path("a b%.bin").write_bytes(gltf.bytes)
        self.assert_square(gltf.write("file.gltf", uri="a%20b%25.bin"))
        Path("Unicode\u2764\u267b.bin").write_bytes(gltf.bytes)
        for uri in ("Unicode\u2764\u267b.bin", "Unicode%E2%9D%A4%E2%99%BB.bin"):
            del gltf.json["buffers"]
            self.assert_square(gltf.write("Unicode\u2764\u267b.gltf", uri=uri))
        write("marked.gltf", "\ufeff" + json.dumps(gltf.json))
        self.assert_square("marked.gltf")

    def test_components(self):
        extension = {"extensionsUsed": ["KHR_mesh_quantization"], "extensionsRequired": ["KHR_mesh_quantization"]}
        for component, most, normalized in (
            (FLOAT, 1, False), (UNSIGNED_BYTE, 255, True), (BYTE, 127, True), (UNSIGNED_SHORT, 65535, True), (SHORT, 32767, True),
            (UNSIGNED_BYTE, 200, False), (BYTE, 100, False), (UNSIGNED_SHORT, 16383, False), (SHORT, 300, False),
        ):  # fmt: skip
            for stride in (0, 12, 16):
                for index in (UNSIGNED_BYTE, UNSIGNED_SHORT, UNSIGNED_INT):
                    gltf = Gltf(**extension)
                    rows = [tuple(most * value for value in row) for row in SQUARE]
                    positions = gltf.accessor(rows, component, stride, normalized=normalized)
                    primitive = {"attributes": {"POSITION": positions}, "indices": gltf.accessor(TWO_TRIANGLES, index)}
                    gltf.place(mesh=gltf.add("meshes", primitives=[primitive]))
                    size = 1 if normalized else most
                    self.assert_square(gltf.write("a.glb"), high=(size, size, 0))
                    if stride:
                        break

    def test_modes(self):
        zigzag = [SQUARE[i] for i in (0, 1, 3, 2)]
        for mode, rows in ((5, zigzag), (6, SQUARE), (4, [SQUARE[i] for i in TWO_TRIANGLES])):
            gltf = Gltf()
            gltf.place(mesh=gltf.add("meshes", primitives=[{"attributes": {"POSITION": gltf.accessor(rows)}, "mode": mode}]))
            self.assert_square(gltf.write("a.gltf"))
        gltf = Gltf()
        gltf.square(mode=1)
        gltf.square()
        self.checked(gltf.write("a.gltf"), "meshes[0].primitives[0]: points and lines are not shown")
        for mode, count in ((4, 8), (5, 2), (6, 1)):
            gltf = Gltf()
            gltf.square()
            rows = [SQUARE[i] for i in TWO_TRIANGLES] + SQUARE
            gltf.place(mesh=gltf.add("meshes", primitives=[{"attributes": {"POSITION": gltf.accessor(rows[:count])}, "mode": mode}]))
            self.checked(gltf.write("a.gltf"), "meshes[1].primitives[0]: vertices that complete no triangle are not shown")

    def test_sparse(self):
        gltf = Gltf()
        moved = {
            "count": 2,
            "indices": {"bufferView": gltf.view(struct.pack("<2H", 1, 2)), "componentType": UNSIGNED_SHORT},
            "values": {"bufferView": gltf.view(struct.pack("<6f", 2, 0, 0, 2, 1, 0))},
        }
        rows = gltf.accessor(SQUARE, sparse=moved)
        gltf.place(mesh=gltf.add("meshes", primitives=[{"attributes": {"POSITION": rows}, "mode": 6}]))
        self.assert_square(gltf.write("based.gltf"), high=(2, 1, 0))
        moved["count"] = 1
        gltf.json["accessors"] = [{"componentType": FLOAT, "count": 3, "type": "VEC3", "sparse": moved}]
        gltf.write("zeros.gltf")
        self.checked("zeros.gltf", "no area and")

    def test_nodes(self):
        half = math.sqrt(0.5)
        gltf = Gltf()
        child = gltf.add("nodes", mesh=0, rotation=[0, 0, half, half], scale=[2, 1, 1])
        middle = gltf.add("nodes", children=[child], matrix=[1, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
        gltf.square(node={"children": [middle], "translation": [16777216.25, 0, 0]})
        del gltf.json["nodes"][2]["mesh"]
        self.assert_square(gltf.write("a.gltf"), (16777215.25, 0, 0), (16777216.25, 6, 0))
        del gltf.json["scenes"], gltf.json["scene"]
        self.assert_square(gltf.write("a.gltf"), (16777215.25, 0, 0), (16777216.25, 6, 0))

    def test_refused(self):
        def change(path, value):
            *parents, last = path

            def apply(root):
                for key in parents:
                    root = root[key]
                root[last] = value

            return apply

        accessor, view, node, primitive = ("accessors", 0), ("bufferViews", 0), ("nodes", 0), ("meshes", 0, "primitives", 0)
        faults = (
            (("extensionsRequired",), ["KHR_draco_mesh_compression"], "extensionsRequired has KHR_draco_mesh_compression"),
            (("asset", "version"), "1.0", "asset.version is '1.0'.* 2.0"),
            (("asset",), {}, "asset.version is missing"),
            (("scene",), 7, "scene must be an integer from 0 to 0, not 7"),
            (("scenes", 0, "nodes"), [0, 0], r"nodes\[0\] is reached twice"),
            (("scenes", 0, "nodes"), [3], r"scenes\[0\].nodes\[0\] must be an integer from 0 to 0"),
            ((*node, "children"), [0], r"nodes\[0\] is reached twice"),
            ((*node, "mesh"), 1.5, r"nodes\[0\].mesh must be an integer from 0 to 0, not 1.5"),
            ((*node, "rotation"), [0, 0, 0, 0], r"nodes\[0\] must have a 'rotation' that is not zero"),
            ((*node, "matrix"), [1], r"nodes\[0\].matrix must be 16 numbers"),
            ((*node, "scale"), [1e31, 1, 1], r"nodes\[0\].scale must be 3 numbers of at most 1e\+30 in magnitude"),
            ((*primitive, "indices"), 9, r"meshes\[0\].primitives\[0\].indices must be an integer from 0 to 1"),
            ((*primitive, "attributes", "POSITION"), -1, r"attributes.POSITION must be an integer"),
            ((*primitive, "attributes", "POSITION"), 1, r"accessors\[1\].type must be 'VEC3' for POSITION, not 'SCALAR'"),
            ((*primitive, "mode"), 7, r"primitives\[0\].mode must be an integer from 0 to 6"),
            ((*accessor, "count"), 1 << 33, r"accessors\[0\].count"),
            ((*accessor, "count"), 5, r"accessors\[0\] ends at byte 60 of a buffer view of 48"),
            ((*accessor, "count"), 3, r"primitives\[0\] names vertex 3 \(counted from 0\) in index 5, but has only 3"),
            ((*accessor, "byteOffset"), 1 << 62, r"accessors\[0\]"),
            ((*accessor, "componentType"), 5124, r"accessors\[0\].componentType must be 5120 to 5123 or 5126 for POSITION, not 5124"),
            ((*accessor, "componentType"), 5125, r"accessors\[0\].componentType must be 5120 to 5123 or 5126 for POSITION, not 5125"),
            (("accessors", 1, "componentType"), 5126, r"accessors\[1\].componentType must be 5121, 5123 or 5125 for indices, not 5126"),
            ((*accessor, "componentType"), None, r"accessors\[0\] lacks"),
            (accessor, 7, r"accessors\[0\] must be an object$"),
            (view, 7, r"bufferViews\[0\] must be an object$"),
            (("accessors",), 7, r"accessors must be an array$"),
            (("asset",), [], r"asset must be an object$"),
            (("meshes",), [None], r"nodes\[0\].mesh refers to meshes\[0\], which is null"),
            (("extensionsRequired",), [7], r"extensionsRequired\[0\] must be a string"),
            ((*view, "byteLength"), 1000, r"bufferViews\[0\] ends at byte 1000 of a buffer of 56"),
            ((*view, "byteStride"), 1, r"bufferViews\[0\].byteStride must be an integer from 4 to 252"),
            (("buffers", 0, "byteLength"), 57, r"buffers\[0\] has only 56 bytes, but its byteLength is 57"),
            (("buffers", 0, "uri"), "data:;base64,%%", r"buffers\[0\].uri is not base64"),
            (("buffers", 0, "uri"), "https://example.org/a", r"buffers\[0\].uri must be a relative path"),
            (("buffers", 0, "uri"), "none.bin", r"buffers\[0\].uri names 'none.bin', which cannot be read: No such file"),
            (("buffers", 0, "uri"), "unreadable.bin", r"buffers\[0\].uri names an unreadable file; cannot read 'unreadable.bin': Input/output error"),
            (("bufferViews",), [], r"bufferView refers to 'bufferViews', which the file lacks"),
            (("nodes",), {}, "nodes must be an array"),
            ((*node, "mesh"), 1e300, r"nodes\[0\].mesh must be an integer from 0 to 0"),
            (("scenes", 0, "nodes"), {}, r"scenes\[0\].nodes must be an array"),
            ((*node, "children"), 1, r"nodes\[0\].children must be an array"),
            (("meshes", 0, "primitives"), {}, r"meshes\[0\].primitives must be an array"),
            (primitive, [], r"meshes\[0\].primitives\[0\] must be an object"),
            ((*primitive, "attributes"), [], r"meshes\[0\].primitives\[0\].attributes must be an object"),
            ((*accessor, "normalized"), 1, r"accessors\[0\].normalized must be true or false"),
            (("extensionsRequired",), "KHR_draco_mesh_compression", "extensionsRequired must be an array"),
        )
        Path("unreadable.bin").symlink_to("/proc/self/mem")
        for path, value, message in faults:
            gltf = Gltf()
            gltf.square()
            gltf.write("a.gltf")
            change(path, value)(gltf.json)
            write("a.gltf", json.dumps(gltf.json))
            errors = self.refuses("check a.gltf", f"^a.gltf: error: .*{message}").stderr
            self.assertEqual(errors.count("error: "), 1, errors)
        write("a.gltf", "[" * 100000)
        self.refuses("check a.gltf", r"^a.gltf:1:\d+: error")
        write("a.gltf", '{\n  "asset": {"version": 2.0,}\n}')
        self.refuses("check a.gltf", r"^a.gltf:2:28: error: .*\n.*\n +\^")
        write("a.glb", "glTF\2")
        self.refuses("check a.glb", "too short to be a GLB file")
        Path("a.glb").write_bytes(struct.pack("<4sIIII", b"glTF", 2, 99, 1 << 31, 0x4E4F534A))
        self.refuses("check a.glb", "byte 12: the file ends within a chunk of 2147483648 bytes")

    def test_bombs(self):
        """Small files that claim much: accessors without bytes, a mesh at many nodes, nodes that are deep."""
        gltf = Gltf(accessors=[{"componentType": FLOAT, "count": 1 << 27, "type": "VEC3"}])
        gltf.place(mesh=gltf.add("meshes", primitives=[{"attributes": {"POSITION": 0}}]))
        self.refuses(f"check {gltf.write('a.gltf')}", "elements in total; at most 67108864 are supported")
        gltf = Gltf(nodes=[{"children": [i + 1]} for i in range(5000)] + [{}])
        gltf.json["scenes"][0]["nodes"] = [0]
        self.refuses(f"check {gltf.write('a.gltf')}", "more than 1000 nodes deep")

    def test_named(self):
        """Each feature that is not shown is named once, with its first place. The square is shown."""
        gltf = Gltf(
            extensionsUsed=["KHR_texture_transform", "KHR_materials_clearcoat", "ACME_thing"], animations=[{}], materials=[{
                "alphaMode": "odd", "normalTexture": {"index": 0}, "occlusionTexture": {"index": 0},
                "pbrMetallicRoughness": {"metallicFactor": "no", "metallicRoughnessTexture": {"index": 0}, "baseColorTexture": {"index": 5}},
            }],
        )  # fmt: skip
        gltf.add("scenes", nodes=[])
        colors = gltf.accessor([(1, 1, 1)] * 4)
        short = gltf.accessor([(0, 0, 1)] * 3)
        for _ in range(2):
            gltf.square(attributes={"COLOR_0": colors, "NORMAL": short}, targets=[{}], material=0, node={"skin": 0, "camera": 3})
        report = self.checked(
            gltf.write("a.gltf"),
            "animations: animations are not played",
            "extensionsUsed has KHR_materials_clearcoat, ACME_thing, which glint does not support",
            "scenes[0]: only this scene is shown",
            "nodes[0].skin: skins are ignored",
            "nodes[0].camera refers to 'cameras', which the file lacks; it is ignored",
            "meshes[0].primitives[0].attributes.COLOR_0: vertex colors",
            "meshes[0].primitives[0].targets: morph targets",
            "materials[0].pbrMetallicRoughness.metallicFactor must be a number",
            "pbrMetallicRoughness.metallicRoughnessTexture: metallic-roughness textures",
            "materials[0].occlusionTexture: occlusion textures",
            "materials[0].pbrMetallicRoughness.baseColorTexture.index refers to 'textures', which the file lacks; it is ignored",
            "materials[0].alphaMode must be OPAQUE, MASK or BLEND, not 'odd'; OPAQUE is used",
            "materials[0].normalTexture.index refers to 'textures', which the file lacks; it is ignored",
            "meshes[0].primitives[0].attributes.NORMAL has 3 elements for 4 positions; it is ignored",
            "nodes[1].camera refers to 'cameras'",
            "meshes[1].primitives[0].attributes.NORMAL has 3 elements",
        )
        self.assertEqual(report["mesh_triangles"], 4)
        write("s.yaml", "camera: {position: [0, 0, 5], look_at: [0, 0, 0]}\nobjects:\n  - mesh: {file: b.gltf}\n")
        gltf = Gltf(cameras=[{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}])
        gltf.square(node={"camera": 0}, material=gltf.add("materials", emissiveFactor=[1, 1, 1]))
        gltf.add("images", bufferView=gltf.view(QUADRANTS), mimeType="image/png")
        gltf.add("textures", source=0)
        unlit = gltf.add("materials", pbrMetallicRoughness={"baseColorTexture": {"index": 0}}, extensions={"KHR_materials_unlit": {}})
        gltf.square(WHOLE, material=unlit)
        gltf.write("b.gltf")
        self.checked("s.yaml", "b.gltf: nodes[0]: cameras and lights of a mesh", "b.gltf: materials[1]: textures emit light or are unlit only if", "no lights")

    def test_losses_of_materials_are_named(self):
        """Each material has one loss. The first is that of Khronos' MultiUVTest."""
        image = {"baseColorTexture": {"index": 0}}
        for material, path, loss in (
            ({"pbrMetallicRoughness": image, "emissiveTexture": {"index": 1, "texCoord": 1}, "emissiveFactor": [1, 1, 1]}, "materials[0]", "emission next to a different texture is not shown"),
            ({"pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}}, "samplers[0].magFilter", "filtering by the nearest texel is not supported"),
            ({"pbrMetallicRoughness": image | {"roughnessFactor": 0}}, "materials[0]", "reflections of metals do not have the colors of a texture"),
            ({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}, "pbrMetallicRoughness": image | {"metallicFactor": 0}}, "materials[0]", "transmitted light does not have the colors of a texture"),
            ({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}, "alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5], "metallicFactor": 0}}, "materials[0]", "a material that is transparent by its alpha transmits no other light"),
            ({"pbrMetallicRoughness": image, "normalTexture": {"index": 0, "texCoord": 1}}, "materials[0].normalTexture", "the normal texture is ignored, because its coordinates differ"),
            ({"extensions": {"KHR_materials_unlit": {}}, "pbrMetallicRoughness": image | {"baseColorFactor": [1, 0, 0, 1]}}, "materials[0]", "an emitted texture is multiplied by the mean of its factors"),
        ):
            gltf = Gltf(materials=[material], samplers=[{"magFilter": 9728}], textures=[{"source": 0}, {"source": 0, "sampler": 0}])
            gltf.add("images", bufferView=gltf.view(QUADRANTS), mimeType="image/png")
            gltf.square(WHOLE, attributes={"TEXCOORD_1": gltf.accessor(WHOLE)}, material=0)
            self.checked(gltf.write("a.gltf"), f"{path}: {loss}")

    def test_volumes_absorb(self):
        """The gray background through a slab with faces at z = 0 and 1, whose attenuation distance is half its thickness."""
        for volume, color in (
            ({"thicknessFactor": 1, "attenuationDistance": 0.5, "attenuationColor": [1, 0.5, 0.1]}, (0.18, 0.18 * 0.25, 0.18 * 0.01)),
            ({"attenuationDistance": 0.5, "attenuationColor": [1, 0.5, 0.1]}, (0.18, 0.18, 0.18)),
            ({"thicknessFactor": 1, "attenuationColor": [1, 0.5, 0.1]}, (0.18, 0.18, 0.18)),
        ):
            gltf = Gltf()
            extensions = {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_ior": {"ior": 1}, "KHR_materials_volume": volume}
            roughness = {"metallicFactor": 0, "roughnessFactor": 1}
            material = gltf.add("materials", extensions=extensions, pbrMetallicRoughness=roughness)
            gltf.square(material=material, node={"translation": [0, 0, 1]})
            gltf.square(material=material, node={"translation": [0, 1, 0], "rotation": [1, 0, 0, 0]})
            camera = gltf.add("cameras", type="perspective", perspective={"yfov": 0.01, "znear": 1})
            gltf.place(camera=camera, translation=[0.5, 0.5, 9])
            path = gltf.write("slab.glb")
            report = self.checked(path)
            self.assertEqual("ABSORPTION" in report["features"], color[1] < 0.18)
            self.glint(f"render {path} --size 1x1 -o slab.npy")
            for got, expected in zip(npy_read("slab.npy")[2][0], color):
                self.assertAlmostEqual(got, expected, delta=1e-5)

    def test_invalid_numbers_become_defaults(self):
        for member, expected in (
            ({"pbrMetallicRoughness": {"baseColorFactor": [1, -1, 0, 1]}}, "pbrMetallicRoughness.baseColorFactor must be from 0 to 1, not -1; the default"),
            ({"pbrMetallicRoughness": {"metallicFactor": 7}}, "pbrMetallicRoughness.metallicFactor must be from 0 to 1, not 7; the default"),
            ({"emissiveFactor": [0, 0, -2]}, "emissiveFactor must be 0 or more, not -2; the default"),
            ({"extensions": {"KHR_materials_ior": {"ior": -1.5}}}, "KHR_materials_ior.ior must be 0 or more, not -1.5; the default"),
        ):
            gltf = Gltf(materials=[member])
            gltf.square(material=0)
            self.checked(gltf.write("a.gltf"), expected)
        text = formatted(DAE, " ")
        write("a.dae", text.replace("<texture texture='s2' texcoord='UV'/>", "<color>-1 0 0 1</color>"))
        self.checked("a.dae", "a color of material 'm' is out of range; the default is used")

    def test_members_of_another_type_are_named(self):
        """The square is shown without such members. null counts as missing."""
        pbr = "materials[0].pbrMetallicRoughness"
        for members, warnings in (
            ({"materials": [{"pbrMetallicRoughness": []}]}, [f"{pbr} must be an object; it is ignored"]),
            ({"materials": [{"pbrMetallicRoughness": {"baseColorTexture": 0}}]}, [f"{pbr}.baseColorTexture must be an object; it is ignored"]),
            (
                {
                    "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": 1}}}}],
                    "textures": [{"source": 0}],
                    "images": [{"uri": 1}],
                },
                [f"{pbr}.baseColorTexture.extensions.KHR_texture_transform must be an object; it is ignored", "images[0].uri must be a string"],
            ),
            ({"materials": [{"alphaMode": 1, "extensions": []}]}, ["materials[0].extensions must be an object", "materials[0].alphaMode must be a string"]),
            ({"materials": [7]}, ["materials[0] must be an object"]),
            (
                {"scenes": [{"nodes": [0]}], "nodes": [{"extensions": {"KHR_lights_punctual": {"light": 0}}}], "extensions": {"KHR_lights_punctual": {"lights": [[]]}}},
                ["extensions.KHR_lights_punctual.lights[0] must be an object"],
            ),
            (
                {"scenes": [{"nodes": [0]}], "nodes": [{"camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}], "cameras": [None], "extensions": {"KHR_lights_punctual": {"lights": [None]}}},
                ["nodes[0].camera refers to cameras[0], which is null", "lights[0].type must be directional, point or spot"],
            ),
            ({"asset": {"version": "2.0", "minVersion": None}, "samplers": [{"magFilter": "nearest"}], "images": [{"uri": "a.png"}], "textures": [{"source": 0, "sampler": 0}], "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "emissiveTexture": {"index": None}}]},
                ["samplers[0].magFilter must be an integer from 9728 to 9729, not \"nearest\"; it is ignored", "cannot read 'a.png'"]),
            ({"materials": [{"pbrMetallicRoughness": None, "extensions": None}], "extensions": None}, []),
        ):
            gltf = Gltf(**members)
            gltf.square(material=0) if "materials" in members else gltf.square()
            self.assertEqual(self.checked(gltf.write("a.gltf"), *warnings)["mesh_triangles"], 2)
        gltf = Gltf()
        gltf.square(attributes={"POSITION": gltf.accessor(SQUARE)})
        gltf.add("meshes", primitives=[{"attributes": {}}])
        gltf.place(mesh=1)
        self.checked(gltf.write("a.gltf"), "meshes[1].primitives[0]: primitives without 'POSITION' are not shown")

    def test_missing_image_is_named(self):
        gltf = Gltf(textures=[{"source": 0}], images=[{"uri": "a%20b.png"}])
        material = gltf.add("materials", pbrMetallicRoughness={"baseColorTexture": {"index": 0}})
        gltf.square(uvs=WHOLE, material=material)
        self.checked(gltf.write("a.gltf"), "images[0]: cannot read 'a b.png': No such file or directory; the material's color is used")
        Path("a b.png").write_bytes(QUADRANTS)
        self.assertIn("IMAGES", self.checked("a.gltf")["features"])
        for uri in ("C:\\Users\\me\\a b.png", "/home/me/a%20b.png", "file:///C:/me/a%20b.png", "textures/a b.png"):
            gltf.json["images"] = [{"uri": uri}]
            report = self.checked(gltf.write("a.gltf"), "'a b.png' is used")
            self.assertIn("IMAGES", report["features"])

    def test_alpha_of_images(self):
        """Alpha is named if a pixel is transparent and the format does not define it as ignored, or blends by it. Colors stay."""
        palette = (b"PLTE", bytes([255, 0, 0, 0, 255, 0]))
        images = {
            "rgba": (png([[(1, 0, 0, 1), (0, 1, 0, 0.5)]], 6), True),
            "opaque": (png([[(1, 0, 0, 1), (0, 1, 0, 1)]], 6), False),
            "key": (png([[RED, GREEN]], 2, (b"tRNS", struct.pack(">HHH", 0, 255, 0))), True),
            "palette": (png([[(0,), (1 / 255,)]], 3, palette, (b"tRNS", b"\xff\x00")), True),
            "plain": (png([[(0,), (1 / 255,)]], 3, palette), False),
        }
        Path("rgb.png").write_bytes(png([[RED, GREEN]]))
        write("a.obj", "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n")
        for name, (data, is_named) in images.items():
            Path(f"{name}.png").write_bytes(data)
            self.glint(f"diff {name}.png rgb.png")
            write("a.mtl", f"newmtl m\nmap_Kd {name}.png\n")
            self.checked("a.obj", *[f"the alpha of '{name}.png' is ignored"] * is_named)
        for mode in ("OPAQUE", "MASK", "BLEND"):
            gltf = Gltf(images=[{"uri": "rgba.png"}], textures=[{"source": 0}])
            gltf.square(WHOLE, material=gltf.add("materials", alphaMode=mode, pbrMetallicRoughness={"baseColorTexture": {"index": 0}}))
            self.checked(gltf.write("a.gltf"), *["the alpha of 'rgba.png' does not blend; the surface is cut out where it is below 0.5"] * (mode == "BLEND"))

    def test_lights_and_cameras(self):
        gltf = Gltf(extensions={"KHR_lights_punctual": {"lights": [
            {"type": "directional"}, {"type": "point", "intensity": 1000, "color": [1, 0.5, 0]}, {"type": "spot", "spot": {"outerConeAngle": 0.5}},
            {"type": "area"}, {"type": "point", "intensity": -1}, {"type": "point", "color": [1, -1, 1]},
        ]}})  # fmt: skip
        gltf.square()
        for i in range(7):
            gltf.place(translation=[0, 0, 3], extensions={"KHR_lights_punctual": {"light": i}})
        gltf.place(camera=gltf.add("cameras", type="orthographic", orthographic={"xmag": 1, "ymag": 1}))
        gltf.place(camera=gltf.add("cameras", type="perspective", perspective={"yfov": 1}))
        report = self.checked(
            gltf.write("a.gltf"),
            "extensions.KHR_lights_punctual.lights[3].type must be directional, point or spot; it is ignored",
            "extensions.KHR_lights_punctual.lights[4].intensity must be 0 or more, not -1; it is ignored",
            "extensions.KHR_lights_punctual.lights[5].color must be 0 or more, not -1; it is ignored",
            "nodes[7].extensions.KHR_lights_punctual.light must be an integer from 0 to 5, not 6; it is ignored",
            "cameras[1]: only the first camera is used",
            "the lights' total around the center is 33.9",
        )
        self.assertEqual(report["lights"], 3)
        self.assertEqual(set(report["features"]), {"TRIANGLES", "POINT_LIGHTS", "DIRECTIONAL_LIGHTS", "SPOT_LIGHTS", "FADING_LIGHTS", "ORTHOGRAPHIC"})

    def test_view_of_a_flat_node(self):
        """A node scaled to a point leaves its camera and its light no direction."""
        gltf = Gltf(extensions={"KHR_lights_punctual": {"lights": [{"type": "directional"}, {"type": "point"}]}})
        gltf.square()
        gltf.place(camera=gltf.add("cameras", type="perspective", perspective={"yfov": 1}), scale=[0, 0, 0])
        for light in 0, 1:
            gltf.place(scale=[0, 0, 0], translation=[0, 0, 1], extensions={"KHR_lights_punctual": {"light": light}})
        report = self.checked(
            gltf.write("a.gltf"),
            "the camera has no direction or a value out of range; a camera that frames the mesh is used instead",
            "1 light has no direction or a value out of range and is ignored",
        )
        self.assertEqual(report["lights"], 1)

    def test_far_camera(self):
        """A camera keeps its direction where a step of 1 is lost in rounding."""
        gltf = Gltf()
        gltf.square()
        gltf.place(camera=gltf.add("cameras", type="perspective", perspective={"yfov": 1}), translation=[0, 0, 1e17])
        self.checked(gltf.write("a.gltf"), "the mesh reaches 1e+17 from the eye")

    def test_parallel_rays(self):
        """From near and afar the square fills half of the frame's height and a quarter of its width."""
        for distance in 3, 4000:
            gltf = Gltf()
            gltf.square()
            gltf.place(camera=gltf.add("cameras", type="orthographic", orthographic={"xmag": 2, "ymag": 1, "znear": 0, "zfar": 1}),
                       translation=[0.5, 0.5, distance])
            self.glint(f"render {gltf.write('a.gltf')} --size 64x32 --aov object --quiet -o a.npy")
            _, _, objects = npy_read("a.object.npy")
            hit = [i for i, number in enumerate(objects) if number != 0xFFFFFFFF]
            self.assertEqual(hit, [64 * row + column for row in range(8, 24) for column in range(24, 40)])
        write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        process = self.glint("render a.gltf --precision certified --size 8x8 -o a.npy", status=1)
        self.assertIn("certified has no error bounds for a camera with parallel rays", process.stderr)

    def test_formats_look_alike(self):
        """A smooth, textured square in four formats gives the same image with the same camera and lights."""
        normals = [(-0.6, 0, 0.8), (0.6, 0, 0.8), (0.6, 0, 0.8), (-0.6, 0, 0.8)]
        Path("a.png").write_bytes(QUADRANTS)
        gltf = Gltf(images=[{"uri": "a.png"}], textures=[{"source": 0}])
        gltf.square(WHOLE, normals, material=gltf.add("materials", pbrMetallicRoughness={"baseColorTexture": {"index": 0}}))
        gltf.write("a.gltf")

        def lines(keyword, rows):
            return "".join(f"{keyword} {' '.join(map(str, row))}\n" for row in rows)

        upward = [(u, 1 - v) for u, v in WHOLE]
        write("a.mtl", "newmtl m\nKd 1 1 1\nmap_Kd a.png\n")
        text = lines("v", SQUARE) + lines("vt", upward) + lines("vn", normals)
        write("a.obj", f"mtllib a.mtl\n{text}usemtl m\nf 1/1/1 2/2/2 3/3/3\nf 1/1/1 3/3/3 4/4/4\n")
        write("a.dae", formatted(DAE, " ", normals, upward))
        write("a.fbx", formatted(FBX, ",", normals, upward))
        images = []
        for ending in ("gltf", "obj", "dae", "fbx"):
            self.checked(f"a.{ending}")
            self.glint(f"render a.{ending} --size 32x32 -o {ending}.npy")
            images.append(npy_read(f"{ending}.npy")[2])
        self.assertGreater(len(set(images[0])), 100)
        for ending, image in zip(("obj", "dae", "fbx"), images[1:]):
            for i, (got, expected) in enumerate(zip(image, images[0])):
                for a, b in zip(got, expected):
                    self.assertAlmostEqual(a, b, delta=1e-4, msg=f"{ending}, pixel {i}")

    @skipUnless(SAMPLE_MODELS.is_dir(), "assimp-testmodels is not installed")
    def test_sample_models(self):
        """Models of Khronos are shown, with warnings of what is not, or refused."""
        metal, alpha = "metallic-roughness textures are ignored", "does not blend; the surface is cut out where it is below 0.5"
        for name, *warnings in [
            ("BoxTextured-glTF/BoxTextured.gltf",),
            ("BoxTextured-glTF-Binary/BoxTextured.glb",),
            ("BoxTextured-glTF-Embedded/BoxTextured.gltf",),
            ("textureTransform/TextureTransformTest.gltf",),
            ("2CylinderEngine-glTF-Binary/2CylinderEngine.glb", "11160 triangles have no area and are never hit"),
            ("cameras/Cameras.gltf", "only the first camera is used"),
            ("glTF-Sample-Models/AnimatedMorphCube-glTF/AnimatedMorphCube.gltf", "animations are not played", "morph targets are ignored"),
            ("simple_skin/simple_skin.gltf", "animations are not played", "skins are ignored"),
            ("ClearCoat-glTF/ClearCoatTest.gltf", "KHR_materials_clearcoat", metal, alpha),
            ("BoxTextured-glTF-pbrSpecularGlossiness/BoxTextured.gltf", "KHR_materials_pbrSpecularGlossiness"),
        ]:
            self.checked(SAMPLE_MODELS / name, *warnings)
        for name, extension in [
            ("draco/2CylinderEngine.gltf", "KHR_draco_mesh_compression"),
            ("BoxTextured-glTF-techniqueWebGL/BoxTextured.gltf", "KHR_technique_webgl"),
        ]:
            self.refuses(f"check {SAMPLE_MODELS / name}", f"extensionsRequired has {extension}, which glint does not support; export the file without it")

    def test_scenes_of_other_formats(self):
        """Cameras, lights and textures are read by assimp. An image with another machine's path is found next to the file."""
        Path("a.png").write_bytes(QUADRANTS)
        text = formatted(DAE, " ")
        text = text.replace("<library_geometries>", DAE_VIEW + "<library_geometries>").replace("<init_from>a.png", "<init_from>C:\\a\\a.png")
        node = "<node id='{0}' name='{0}'><translate>0.5 0.5 {1}</translate><instance_{2} url='#{3}'/></node>"
        nodes = node.format("C", 2, "camera", "c") + node.format("L", 2, "light", "l") + node.format("P", 3, "light", "p")
        write("a.dae", text.replace("</visual_scene>", nodes + "</visual_scene>"))
        report = self.checked("a.dae", "m: 'C:\\a\\a.png' does not exist; 'a.png' is used")
        self.assertEqual(set(report["features"]), {"TRIANGLES", "SMOOTH_NORMALS", "DIRECTIONAL_LIGHTS", "SPOT_LIGHTS", "FADING_LIGHTS", "IMAGES"})
        self.glint("render a.dae --size 20x10 -o a.npy")
        row = npy_read("a.npy")[2][100:120]  # 60 degrees wide, at a distance of 2: the square is 8.7 columns wide
        self.assertEqual([i for i, color in enumerate(row) if abs(color[0] - 0.18) > 1e-3 or abs(color[1] - 0.18) > 1e-3], list(range(6, 14)))
        write("s.yaml", "camera: {position: [0, 0, 5], look_at: [0, 0, 0]}\nlights: [{point: {position: [0, 0, 5]}}]\nobjects:\n  - mesh: {file: a.dae}\n")
        self.checked("s.yaml", "a.dae: cameras and lights of a mesh are ignored", "a.dae: m: 'C:\\a\\a.png' does not exist")

    def test_pixels(self):
        """One square for each material, side by side, lit by 1 along the view."""
        gltf = Gltf(extensions={"KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": math.pi}]}})
        image = gltf.add("images", bufferView=gltf.view(QUADRANTS), mimeType="image/png")
        for clamp in (10497, 33071, 33648):
            gltf.add("textures", source=image, sampler=gltf.add("samplers", wrapS=clamp, wrapT=clamp))
        bumps = gltf.add("textures", source=gltf.add("images", bufferView=gltf.view(NORMALS), mimeType="image/png"))
        cells = []

        def cell(colors, uvs=None, normals=None, attributes=(), scale=1, **material):
            """Adds a square. Colors are one for all of it, or four by quadrants, upper left, right, lower left, right."""
            x = len(cells)
            cells.append(colors if isinstance(colors, list) else [colors] * 4)
            material = gltf.add("materials", **material) if material else None
            node = {"translation": [x + (scale < 0), 0, 0], "scale": [scale, 1, 1]}
            gltf.square(uvs, normals, node, attributes=dict(attributes), **({} if material is None else {"material": material}))

        def factor(*color, **more):
            return {"pbrMetallicRoughness": {"baseColorFactor": color, "metallicFactor": 0} | more}

        def texture(index=0, transform=None, **more):
            info = {"index": index} | more
            if transform:
                info["extensions"] = {"KHR_texture_transform": transform}
            return {"pbrMetallicRoughness": {"baseColorTexture": info}}

        gray = (0.18, 0.18, 0.18)
        quadrants = [RED, GREEN, BLUE, WHITE]
        cell(WHITE)
        cell(RED, **factor(1, 0, 0, 0.25))
        cell(gray, alphaMode="MASK", **factor(1, 0, 0, 0.25))
        cell(RED, alphaMode="MASK", alphaCutoff=0.25, **factor(1, 0, 0, 0.25))
        cell((0.385, 0.135, 0.135), alphaMode="BLEND", **factor(1, 0, 0, 0.25))
        cell((0.5, 0.25, 0), extensions={"KHR_materials_unlit": {}}, normals=[(1, 0, 0)] * 4, **factor(0.5, 0.25, 0, 1))
        cell((0, 0.75, 0), emissiveFactor=[0, 0.5, 0], extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 1.5}}, **factor(0, 0, 0, 1))
        cell((0.5, 0, 0.25), emissiveFactor=[0, 0, 0.25], **factor(0.5, 0, 0, 1))
        cell((0.8, 0.8, 0.8), normals=[(0, 0.6, 0.8)] * 4)
        cell((0.195, 0.195, 0.195), normals=[(0.8, 0, 0.6)] * 4, extensions={"KHR_materials_transmission": {"transmissionFactor": 0.5}}, **factor(0.5, 0.5, 0.5, 1))
        cell(gray, **factor(1, 1, 1, 1, metallicFactor=1, roughnessFactor=0))
        cell(quadrants, WHOLE, **texture())
        cell([[0.8 * value for value in color] for color in (GREEN, RED, WHITE, BLUE)], WHOLE, [(0, 0.6, 0.8)] * 4, scale=-1, **texture())
        cell([(0.5 * r, 0.25 * g, b) for r, g, b in quadrants], WHOLE, **{"pbrMetallicRoughness": texture()["pbrMetallicRoughness"] | {"baseColorFactor": [0.5, 0.25, 1, 1]}})
        cell([GREEN, RED, WHITE, BLUE], WHOLE, **texture(transform={"offset": [0.5, 0]}))
        cell([BLUE, RED, WHITE, GREEN], WHOLE, **texture(transform={"rotation": math.pi / 2}))
        # As in Khronos' TextureTransformTest. The extension's GLSL listing, which turns the other way
        # (KhronosGroup/glTF issue 1563), gives blue; scaling last gives green, no rotation white.
        cell(RED, [(0.48, 0.42)] * 4, **texture(transform={"offset": [0.2, 0.5], "rotation": 1.2, "scale": [0.75, 0.25]}))
        cell([RED] * 4, WHOLE, **texture(transform={"scale": [0.25, 0.25], "offset": [0.125, 0.125]}))
        cell([GREEN, GREEN, WHITE, WHITE], WHOLE, **texture(1, {"offset": [1, 0]}))
        cell([GREEN, RED, WHITE, BLUE], WHOLE, **texture(2, {"offset": [1, 0]}))
        cell(BLUE, WHOLE, attributes={"TEXCOORD_1": gltf.accessor([(0.25, 0.75)] * 4)}, **texture(texCoord=1))
        cell(quadrants, [], attributes={"TEXCOORD_0": gltf.accessor([(65535 * u, 65535 * v) for u, v in WHOLE], UNSIGNED_SHORT, normalized=True)}, **texture())
        cell(quadrants, WHOLE, emissiveFactor=[1, 1, 1], emissiveTexture={"index": 0}, **factor(0, 0, 0, 1))
        # Lambert's cosine for the normals of the texture on a square with this normal, which lean to +x and +y.
        right, high = [(0.6, 0, 0.8)] * 4, [(0, 0.6, 0.8)] * 4
        shades = [[[shade] * 3 for shade in row] for row in ((0.8, 1, 0.64, 0.64), (0.8, 0.64, 1, 0.28), (0.8, 0.64, 0.28, 1))]
        cell(shades[0], WHOLE, right, normalTexture={"index": bumps})
        cell(shades[1], WHOLE, high, normalTexture={"index": bumps})
        cell([[0.8] * 3] * 4, WHOLE, right, normalTexture={"index": bumps, "scale": 0})
        cell([[a * b for a, b in zip(*both)] for both in zip(quadrants, shades[1])], WHOLE, high, normalTexture={"index": bumps}, **texture())
        # moved by half a texture, the color, the normals, and both
        half = {"offset": [0.5, 0]}
        moved_shades, moved = [[row[i] for i in (1, 0, 3, 2)] for row in (shades[1], quadrants)]
        info = {"index": bumps, "extensions": {"KHR_texture_transform": half}}
        cell([[a * b for a, b in zip(*both)] for both in zip(moved, shades[1])], WHOLE, high, normalTexture={"index": bumps}, **texture(transform=half))
        cell([[a * b for a, b in zip(*both)] for both in zip(quadrants, moved_shades)], WHOLE, high, normalTexture=info, **texture())
        cell([[a * b for a, b in zip(*both)] for both in zip(moved, moved_shades)], WHOLE, high, normalTexture=info, **texture(transform=half))
        # upside down: the image and its normals turn together
        over = {"index": bumps, "extensions": {"KHR_texture_transform": {"scale": [1, -1]}}}
        cell([shades[2][i] for i in (2, 3, 0, 1)], WHOLE, high, normalTexture=over)
        cell(WHITE, **texture())
        distance, count = 20, len(cells)
        camera = gltf.add("cameras", type="perspective", perspective={"yfov": 2 * math.atan(0.5 / distance), "znear": 1, "aspectRatio": count})
        gltf.place(camera=camera, translation=[count / 2, 0.5, distance], extensions={"KHR_lights_punctual": {"light": 0}})
        path = gltf.write("a.glb")
        process = self.glint(f"render {path} --size {8 * count}x8 -o a.npy")
        self.assertEqual(process.stderr.count("warning"), 1, process.stderr)
        self.assertIn(f"meshes[{count - 1}].primitives[0]: the mesh has no coordinates for its texture", process.stderr)
        _, _, pixels = npy_read("a.npy")
        for i, colors in enumerate(cells):
            for k, color in enumerate(colors):
                got = pixels[(1 + 5 * (k // 2)) * 8 * count + 8 * i + 1 + 5 * (k % 2)]
                for a, b in zip(got, color):
                    self.assertAlmostEqual(a, b, delta=4e-3, msg=f"material {i}, quadrant {k}: {got}, not {color}")


if __name__ == "__main__":
    main()
