"""glTF 2.0 files read by nothing but json and numpy, so that what they show can be compared with what the package makes of them.

Only what the comparisons need: triangles, the metallic-roughness material with its textures, nodes at rest. A file may also be changed
(light, a camera, other materials, motion) and saved, so that two renderers are given the same bytes.
"""

import base64
import copy
import json
import shutil
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Json = dict[str, Any]

DTYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
LENGTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
TRIANGLES = 4


@dataclass
class Placed:
    """A primitive where a node puts it."""

    name: str
    world: Array
    """World from object, shape (4, 4)."""
    primitive: Json


class Gltf:
    """A file, as its JSON and its bytes."""

    def __init__(self, path: Path) -> None:
        content = path.read_bytes()
        self.folder, self.chunk = path.parent, b""
        if content[:4] == b"glTF":
            length = struct.unpack("<I", content[12:16])[0]
            self.json: Json = json.loads(content[20 : 20 + length])
            self.chunk = content[28 + length :]
        else:
            self.json = json.loads(content)

    def bytes_of(self, holder: Json) -> bytes:
        """What a buffer or an image holds."""
        uri = holder.get("uri")
        if uri is None:
            return self.view(holder["bufferView"]) if "bufferView" in holder else self.chunk
        if uri.startswith("data:"):
            return base64.b64decode(uri.split(",", 1)[1])
        return Path(self.folder, uri).read_bytes()

    def view(self, index: int) -> bytes:
        view: Json = self.json["bufferViews"][index]
        begin = view.get("byteOffset", 0)
        end: int = begin + view["byteLength"]
        return self.bytes_of(self.json["buffers"][view["buffer"]])[begin:end]

    def accessor(self, index: int) -> Array:
        """Shape (count, components); neither sparse nor normalised ones are in the files that are compared."""
        accessor = self.json["accessors"][index]
        if "sparse" in accessor or accessor.get("normalized"):
            raise ValueError(f"accessor {index}: sparse or normalised")
        dtype, length = np.dtype(DTYPES[accessor["componentType"]]), LENGTHS[accessor["type"]]
        view = self.json["bufferViews"][accessor["bufferView"]]
        stride = view.get("byteStride", dtype.itemsize * length)
        return np.ndarray(
            (accessor["count"], length),
            dtype,
            self.view(accessor["bufferView"]),
            accessor.get("byteOffset", 0),
            (stride, dtype.itemsize),
        )

    def placed(self) -> Iterator[tuple[Json, Array]]:
        """Every node of the scene that is shown, with world from node."""
        json = self.json
        waiting = [(index, np.eye(4)) for index in json["scenes"][json.get("scene", 0)]["nodes"]]
        while waiting:
            index, parent = waiting.pop()
            node = json["nodes"][index]
            world = parent @ local(node)
            yield node, world
            waiting += [(child, world) for child in node.get("children", [])]

    def primitives(self) -> Iterator[Placed]:
        """All triangles."""
        for node, world in self.placed():
            for primitive in self.json["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
                if primitive.get("mode", TRIANGLES) == TRIANGLES:
                    yield Placed(node.get("name", ""), world, primitive)

    def camera(self) -> tuple[Array, float]:
        """World from camera, and the vertical angle of view in radians, of the first camera that stands somewhere."""
        node, world = next((node, world) for node, world in self.placed() if "camera" in node)
        return world, self.json["cameras"][node["camera"]]["perspective"]["yfov"]

    def changed(self) -> "Gltf":
        """A copy that may be changed."""
        other = copy.copy(self)
        other.json = copy.deepcopy(self.json)
        return other

    def add_array(self, values: Array) -> int:
        """A new accessor of rows of float32 or of single uint32, in a buffer of its own; its number."""
        uri = "data:application/octet-stream;base64," + base64.b64encode(values.tobytes()).decode()
        rows = values.reshape(len(values), -1)
        self.json["buffers"].append({"uri": uri, "byteLength": values.nbytes})
        self.json["bufferViews"].append({"buffer": len(self.json["buffers"]) - 1, "byteLength": values.nbytes})
        self.json["accessors"].append(
            {
                "bufferView": len(self.json["bufferViews"]) - 1,
                "componentType": next(code for code, dtype in DTYPES.items() if values.dtype == dtype),
                "count": len(rows),
                "type": next(name for name, length in LENGTHS.items() if rows.shape[1] == length),
                "min": rows.min(axis=0).tolist(),
                "max": rows.max(axis=0).tolist(),
            }
        )
        return len(self.json["accessors"]) - 1

    def save(self, folder: Path) -> Path:
        """The file with all that it needs, in a folder of its own."""
        for holder in [*self.json.get("buffers", []), *self.json.get("images", [])]:
            uri = holder.get("uri", "data:")
            if not uri.startswith("data:"):
                shutil.copy(self.folder / uri, folder / uri)
        text = json.dumps(self.json).encode()
        parts = [(b"JSON", text + b" " * (-len(text) % 4))]
        if self.chunk:
            parts.append((b"BIN\0", self.chunk))
        body = b"".join(struct.pack("<I", len(part)) + kind + part for kind, part in parts)
        path = folder / "scene.glb"
        path.write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body)
        return path


def local(node: Json) -> Array:
    """Parent from node."""
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * np.array(node.get("scale", (1, 1, 1)), float)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix
