"""Writes PNG files of 8 bits."""
import struct
import zlib

GRAY, RGB = 0, 2


def chunk(name, data):
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def png(width, height, color, rows, *chunks):
    """Returns a PNG of rows, each of which begins with its filter, with further chunks before them."""
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, color, 0, 0, 0))
    return b"".join([b"\x89PNG\r\n\x1a\n", header, *chunks, chunk(b"IDAT", zlib.compress(rows, 9)), chunk(b"IEND", b"")])
