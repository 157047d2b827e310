"""Writes a square in mesh formats: glTF, built member by member, COLLADA and FBX."""
import base64
import json
import struct
from pathlib import Path

from glint import write

BYTE, UNSIGNED_BYTE, SHORT, UNSIGNED_SHORT, UNSIGNED_INT, FLOAT = 5120, 5121, 5122, 5123, 5125, 5126
LETTERS = {BYTE: "b", UNSIGNED_BYTE: "B", SHORT: "h", UNSIGNED_SHORT: "H", UNSIGNED_INT: "I", FLOAT: "f"}
SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
TWO_TRIANGLES = [0, 1, 2, 0, 2, 3]
WHOLE = [(0, 1), (1, 1), (1, 0), (0, 0)]  # texture coordinates of SQUARE that show the image upright


class Gltf:
    """A glTF file under construction. `json` holds its members."""

    def __init__(self, **members):
        self.bytes = b""
        self.json = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]} | members

    def add(self, array, **members):
        self.json.setdefault(array, []).append(members)
        return len(self.json[array]) - 1

    def view(self, data, **members):
        self.bytes += bytes(-len(self.bytes) % 4)
        offset = len(self.bytes)
        self.bytes += data
        return self.add("bufferViews", buffer=0, byteOffset=offset, byteLength=len(data), **members)

    def accessor(self, rows, component=FLOAT, stride=0, **members):
        rows = [row if isinstance(row, tuple) else (row,) for row in rows]
        layout = f"<{len(rows[0])}{LETTERS[component]}"
        data = b"".join(struct.pack(layout, *row).ljust(stride, b"\xff") for row in rows)
        view = self.view(data, **({"byteStride": stride} if stride else {}))
        kind = ("SCALAR", "VEC2", "VEC3", "VEC4", *[None] * 11, "MAT4")[len(rows[0]) - 1]
        return self.add("accessors", bufferView=view, componentType=component, count=len(rows), type=kind, **members)

    def square(self, uvs=None, normals=None, node=(), **primitive):
        """Adds a unit square at a node."""
        attributes = {"POSITION": self.accessor(SQUARE)}
        if uvs:
            attributes["TEXCOORD_0"] = self.accessor(uvs)
        if normals:
            attributes["NORMAL"] = self.accessor(normals)
        attributes |= primitive.pop("attributes", {})
        primitive = {"attributes": attributes, "indices": self.accessor(TWO_TRIANGLES, UNSIGNED_BYTE)} | primitive
        return self.place(mesh=self.add("meshes", primitives=[primitive]), **dict(node))

    def place(self, **node):
        index = self.add("nodes", **node)
        self.json["scenes"][0]["nodes"].append(index)
        return index

    def write(self, path, uri=None):
        """Writes the file as .glb, or as JSON with the buffer embedded or in a separate file."""
        self.bytes += bytes(-len(self.bytes) % 4)
        buffer = {"byteLength": len(self.bytes)}
        if path.endswith(".glb"):
            text = json.dumps(self.json | {"buffers": [buffer]}).encode()
            text += b" " * (-len(text) % 4)
            data = struct.pack("<II", len(text), 0x4E4F534A) + text
            data += struct.pack("<II", len(self.bytes), 0x004E4942) + self.bytes
            Path(path).write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(data)) + data)
            return path
        encoded = "data:application/octet-stream;base64," + base64.b64encode(self.bytes).decode()
        if self.bytes:
            self.json.setdefault("buffers", [buffer | {"uri": uri or encoded}])
        return write(path, json.dumps(self.json))


def dae_source(name, count, size, axes):
    parameters = "".join(f"<param name='{axis}' type='float'/>" for axis in axes)
    return (
        f"<source id='{name}'><float_array id='{name}f' count='{count}'>{{{name}}}</float_array><technique_common><accessor source='#{name}f' "
        f"count='4' stride='{size}'>{parameters}</accessor></technique_common></source>\n"
    )


DAE = (
    "<?xml version='1.0'?><COLLADA version='1.4.1'><library_images><image id='i'><init_from>a.png</init_from></image></library_images>\n"
    "<library_effects><effect id='e'><profile_COMMON><newparam sid='s1'><surface type='2D'><init_from>i</init_from></surface></newparam>"
    "<newparam sid='s2'><sampler2D><source>s1</source></sampler2D></newparam><technique sid='t'><lambert><diffuse><texture texture='s2' "
    "texcoord='UV'/></diffuse></lambert></technique></profile_COMMON></effect></library_effects>\n"
    "<library_materials><material id='m' name='m'><instance_effect url='#e'/></material></library_materials>\n"
    "<library_geometries><geometry id='g'><mesh>"
    + dae_source("v", 12, 3, "XYZ")
    + dae_source("n", 12, 3, "XYZ")
    + dae_source("t", 8, 2, "ST")
    + "<vertices id='p'><input semantic='POSITION' source='#v'/></vertices><triangles count='2' material='mm'>"
    "<input semantic='VERTEX' source='#p' offset='0'/><input semantic='NORMAL' source='#n' offset='0'/>"
    "<input semantic='TEXCOORD' source='#t' offset='0' set='0'/><p>0 1 2 0 2 3</p></triangles></mesh></geometry></library_geometries>\n"
    "<library_visual_scenes><visual_scene id='s'><node id='a' name='a'><instance_geometry url='#g'><bind_material><technique_common>"
    "<instance_material symbol='mm' target='#m'><bind_vertex_input semantic='UV' input_semantic='TEXCOORD' input_set='0'/>"
    "</instance_material></technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>\n"
    "<scene><instance_visual_scene url='#s'/></scene></COLLADA>\n"
)

DAE_VIEW = (
    "<library_cameras><camera id='c' name='C'><optics><technique_common><perspective><xfov>60</xfov><aspect_ratio>2</aspect_ratio>"
    "<znear>0.1</znear><zfar>100</zfar></perspective></technique_common></optics></camera></library_cameras>\n"
    "<library_lights><light id='l' name='L'><technique_common><directional><color>1 1 1</color></directional></technique_common></light>"
    "<light id='p' name='P'><technique_common><spot><color>9 9 9</color><quadratic_attenuation>1</quadratic_attenuation>"
    "<falloff_angle>60</falloff_angle></spot></technique_common></light></library_lights>\n"
)

FBX = """; FBX 7.4.0 project file
FBXHeaderExtension:  {{
	FBXHeaderVersion: 1003
	FBXVersion: 7400
}}
Objects:  {{
	Geometry: 1, "Geometry::a", "Mesh" {{
		Vertices: *12 {{
			a: {v}
		}}
		PolygonVertexIndex: *6 {{
			a: 0,1,-3,0,2,-4
		}}
		GeometryVersion: 124
		LayerElementNormal: 0 {{
			MappingInformationType: "ByVertice"
			ReferenceInformationType: "Direct"
			Normals: *12 {{
				a: {n}
			}}
		}}
		LayerElementUV: 0 {{
			Name: ""
			MappingInformationType: "ByVertice"
			ReferenceInformationType: "Direct"
			UV: *8 {{
				a: {t}
			}}
		}}
		LayerElementMaterial: 0 {{
			MappingInformationType: "AllSame"
			ReferenceInformationType: "IndexToDirect"
			Materials: *1 {{
				a: 0
			}}
		}}
		Layer: 0 {{
			Version: 100
			LayerElement:  {{
				Type: "LayerElementNormal"
				TypedIndex: 0
			}}
			LayerElement:  {{
				Type: "LayerElementUV"
				TypedIndex: 0
			}}
			LayerElement:  {{
				Type: "LayerElementMaterial"
				TypedIndex: 0
			}}
		}}
	}}
	Model: 2, "Model::a", "Mesh" {{
		Version: 232
	}}
	Material: 3, "Material::m", "" {{
		Version: 102
		ShadingModel: "lambert"
		Properties70:  {{
			P: "DiffuseColor", "Color", "", "A",1,1,1
		}}
	}}
	Texture: 4, "Texture::t", "" {{
		Type: "TextureVideoClip"
		Version: 202
		RelativeFilename: "a.png"
		FileName: "a.png"
	}}
}}
Connections:  {{
	C: "OO",2,0
	C: "OO",1,2
	C: "OO",3,2
	C: "OP",4,3, "DiffuseColor"
}}
"""


def formatted(text, separator, normals=((0, 0, 1),) * 4, uvs=tuple(WHOLE)):
    """Returns a text with SQUARE's numbers."""
    numbers = {"v": SQUARE, "n": normals, "t": uvs}
    return text.format(**{name: separator.join(str(x) for row in rows for x in row) for name, rows in numbers.items()})
