"""Small scenes in one file, made by hand."""

import json
import struct


def glb(document: dict, binary: bytes) -> bytes:
    """The container of glTF 2.0: a header, a chunk of JSON, a chunk of bytes; all a multiple of four long."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def triangle() -> bytes:
    """One red triangle before a camera."""
    corners = [(-1, -1, 0), (1, -1, 0), (0, 1, 0)]
    binary = b"".join(struct.pack("<3f", *corner) for corner in corners)
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1], "name": "triangle"}],
        "nodes": [{"mesh": 0}, {"camera": 0, "translation": [0, 0, 4]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.1, 0.05, 1], "metallicFactor": 0}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 3,
                "type": "VEC3",
                "min": [-1, -1, 0],
                "max": [1, 1, 0],
            }
        ],
        "bufferViews": [{"buffer": 0, "byteLength": len(binary)}],
        "buffers": [{"byteLength": len(binary)}],
    }
    return glb(document, binary)


def reaches_out() -> bytes:
    """The same, but its bytes are a file beside it, which an upload has not."""
    whole = triangle()
    return whole.replace(b'"byteLength": 36}]}', b'"byteLength":36,"uri":"/etc/hostname"}]}')
