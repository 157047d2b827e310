"""Provides the small files that tools/chaos renders and enlarges."""
import struct

SCENE = """\
camera: {position: [0, 1, -4], look_at: [0, 0, 0], fov: 60}
lights: [{point: {position: [3, 5, -3]}}]
objects:
  - sphere: {center: [0, 0.5, 0], radius: 0.5, material: {reflection: 0.5}}
  - sphere: {center: [0, -100, 0], radius: 100}
"""
MESH_SCENE = """\
camera: {position: [0, 1, -4], look_at: [0, 0, 0], fov: 60}
lights: [{point: {position: [3, 5, -3]}}]
objects:
  - mesh: {file: mesh.obj}
  - mesh: {file: mesh.ply}
  - sphere: {center: [0, 1, 0], radius: 0.3, material: {image: texture.png}}
"""
GLTF = b"""\
{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
"bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36,
"uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}
"""
OFF = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
OFF_SCENE = MESH_SCENE.partition("  - mesh")[0] + "  - mesh: {file: mesh.off}\n"
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n"
PLY = """\
ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 1
1 0 1
0 1 1
3 0 1 2
"""


def npy(shape):
    header = f"{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode()


def exr(width, height):
    def attribute(name, kind, data):
        return name + b"\0" + kind + b"\0" + struct.pack("<I", len(data)) + data
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    channels = b"".join(name + b"\0" + struct.pack("<IIII", 2, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    return (struct.pack("<II", 20000630, 2) + attribute(b"channels", b"chlist", channels) +
            attribute(b"compression", b"compression", b"\0") + attribute(b"dataWindow", b"box2i", window) +
            attribute(b"displayWindow", b"box2i", window) + attribute(b"lineOrder", b"lineOrder", b"\0") +
            attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1)) +
            attribute(b"screenWindowCenter", b"v2f", struct.pack("<2f", 0, 0)) +
            attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0")


def jpeg(width, height):
    """Returns a gray JPEG whose header has the given size, with a single block, which is complete at 1x1."""
    def segment(name, data):
        return b"\xff" + name + struct.pack(">H", len(data) + 2) + data
    one_code = b"\1" + bytes(15) + b"\0"
    return (b"\xff\xd8" + segment(b"\xdb", b"\0" + b"\1" * 64) +
            segment(b"\xc0", struct.pack(">BHHB", 8, height, width, 1) + b"\1\x11\0") +
            segment(b"\xc4", b"\0" + one_code) + segment(b"\xc4", b"\x10" + one_code) +
            segment(b"\xda", b"\1\1\0\0\x3f\0") + b"\x3f\xff\xd9")


def pixels(content):
    """Returns a file's content, or only the size and pixels of a PNG, because its texts name the device."""
    if content is None or not content.startswith(b"\x89PNG"):
        return content
    kept, at = b"", 8
    while at + 8 <= len(content):
        length, name = struct.unpack_from(">I4s", content, at)
        kept += content[at:at + 12 + length] if name in (b"IHDR", b"IDAT", b"IEND") else b""
        at += 12 + length
    return kept if at == len(content) else content
