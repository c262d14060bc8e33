#!/usr/bin/env python3
"""Scenes for measurements that are too large to be kept, or put together of samples that are not ours to keep.

    python3 xtask/scenes.py waves OUT.glb --triangles 1000000
    python3 xtask/scenes.py join OUT.glb Fox.glb CesiumMilkTruck.glb
    python3 xtask/scenes.py bend OUT.glb --triangles 100000

waves: still meshes of rolling ground beside each other. join: all nodes and animations of several files in one (the first animation of
each but for a name after a colon, as Fox.glb:Walk). bend: one skinned strip with four joints, which an animation bends.
"""

from __future__ import annotations

import argparse
import json
import math
import struct
from array import array
from pathlib import Path
from typing import Any

Gltf = dict[str, Any]

FLOAT, UNSIGNED, SHORT = 5126, 5125, 5123
FILES_OF_WAVES = 8


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["waves", "join", "bend"])
    parser.add_argument("out", type=Path)
    parser.add_argument("files", nargs="*")
    parser.add_argument("--triangles", type=int, default=1_000_000)
    given = parser.parse_args()
    match given.what:
        case "waves":
            write(given.out, *waves(given.triangles))
        case "join":
            write(given.out, *join(given.files))
        case "bend":
            write(given.out, *bend(given.triangles))


class Maker:
    """A file with one buffer."""

    def __init__(self) -> None:
        self.json: Gltf = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "buffers": [{}]}
        for kind in ["nodes", "meshes", "accessors", "bufferViews"]:
            self.json[kind] = []
        self.bytes = bytearray()

    def add(self, values: array[Any], component: int, shape: str, per_element: int, **more: Any) -> int:
        """The accessor's number."""
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(values) * values.itemsize})
        self.bytes += values.tobytes()
        view, count = len(self.json["bufferViews"]) - 1, len(values) // per_element
        self.json["accessors"].append({"bufferView": view, "componentType": component, "type": shape, "count": count, **more})
        return len(self.json["accessors"]) - 1

    def done(self) -> tuple[Gltf, bytes]:
        self.json["buffers"][0]["byteLength"] = len(self.bytes)
        return self.json, bytes(self.bytes)


def height(x: float, z: float) -> float:
    return 0.3 * math.sin(3.1 * x) * math.cos(2.3 * z) + 0.05 * math.sin(23.0 * x + 17.0 * z)


def grid(columns: int, rows: int, at: tuple[float, float], size: tuple[float, float]) -> tuple[array[float], array[float], array[int]]:
    """Positions, normals and indices of ground."""
    positions, normals, indices = array("f"), array("f"), array("I")
    for row in range(rows + 1):
        for column in range(columns + 1):
            x, z = at[0] + size[0] * column / columns, at[1] + size[1] * row / rows
            step = 1e-3
            slope = [(height(x + step, z) - height(x, z)) / step, (height(x, z + step) - height(x, z)) / step]
            length = math.sqrt(1.0 + slope[0] ** 2 + slope[1] ** 2)
            positions.extend([x, height(x, z), z])
            normals.extend([-slope[0] / length, 1.0 / length, -slope[1] / length])
    for row in range(rows):
        for column in range(columns):
            a = row * (columns + 1) + column
            b, c, d = a + 1, a + columns + 1, a + columns + 2
            indices.extend([a, c, b, b, c, d])
    return positions, normals, indices


def bounds(positions: array[float]) -> dict[str, list[float]]:
    return {"min": [min(positions[k::3]) for k in range(3)], "max": [max(positions[k::3]) for k in range(3)]}


def waves(triangles: int) -> tuple[Gltf, bytes]:
    made = Maker()
    side = max(1, round(math.sqrt(triangles / 2 / FILES_OF_WAVES)))
    for number in range(FILES_OF_WAVES):
        positions, normals, indices = grid(side, side, (2.0 * (number % 4) - 4.0, 2.0 * (number // 4) - 2.0), (2.0, 2.0))
        attributes = {
            "POSITION": made.add(positions, FLOAT, "VEC3", 3, **bounds(positions)),
            "NORMAL": made.add(normals, FLOAT, "VEC3", 3),
        }
        made.json["meshes"].append({"primitives": [{"attributes": attributes, "indices": made.add(indices, UNSIGNED, "SCALAR", 1)}]})
        made.json["nodes"].append({"mesh": number, "name": f"waves {number}"})
        made.json["scenes"][0]["nodes"].append(number)
    return made.done()


def bend(triangles: int) -> tuple[Gltf, bytes]:
    made = Maker()
    columns = max(1, round(math.sqrt(triangles / 2 * 8)))
    positions, normals, indices = grid(columns, max(1, triangles // 2 // columns), (0.0, -0.25), (4.0, 0.5))
    joints, weights = array("H"), array("f")
    for x in positions[0::3]:
        place = min(max(x, 0.0), 3.0)
        first = min(int(place), 2)
        joints.extend([first, first + 1, 0, 0])
        weights.extend([1.0 - (place - first), place - first, 0.0, 0.0])
    attributes = {
        "POSITION": made.add(positions, FLOAT, "VEC3", 3, **bounds(positions)),
        "NORMAL": made.add(normals, FLOAT, "VEC3", 3),
        "JOINTS_0": made.add(joints, SHORT, "VEC4", 4),
        "WEIGHTS_0": made.add(weights, FLOAT, "VEC4", 4),
    }
    made.json["meshes"].append({"primitives": [{"attributes": attributes, "indices": made.add(indices, UNSIGNED, "SCALAR", 1)}]})
    chain = [{"name": f"joint {k}", "translation": [float(k > 0), 0.0, 0.0], **({"children": [k + 2]} if k < 3 else {})} for k in range(4)]
    made.json["nodes"] = [{"mesh": 0, "skin": 0, "name": "strip"}, *chain]
    made.json["scenes"][0]["nodes"] = [0, 1]
    inverse = array("f")
    for k in range(4):
        inverse.extend([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -float(k), 0, 0, 1])
    made.json["skins"] = [{"joints": [1, 2, 3, 4], "inverseBindMatrices": made.add(inverse, FLOAT, "MAT4", 16)}]
    times = made.add(array("f", [0.0, 1.0, 2.0]), FLOAT, "SCALAR", 1, min=[0.0], max=[2.0])
    turns = array("f")
    for angle in [-0.4, 0.4, -0.4]:
        turns.extend([0.0, 0.0, math.sin(angle / 2), math.cos(angle / 2)])
    output = made.add(turns, FLOAT, "VEC4", 4)
    channels = [{"sampler": 0, "target": {"node": node, "path": "rotation"}} for node in [2, 3, 4]]
    made.json["animations"] = [{"name": "Bend", "samplers": [{"input": times, "output": output}], "channels": channels}]
    return made.done()


def read(path: str) -> tuple[Gltf, bytes]:
    data = Path(path).read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + length]), data[20 + length + 8 :]


# What the numbers in a part's members refer to.
REFERENCES = {
    "nodes": {"mesh": "meshes", "skin": "skins", "camera": "cameras", "children": "nodes"},
    "primitives": {"attributes": "accessors", "indices": "accessors", "targets": "accessors", "material": "materials"},
    "skins": {"joints": "nodes", "skeleton": "nodes", "inverseBindMatrices": "accessors"},
    "accessors": {"bufferView": "bufferViews"},
    "bufferViews": {},
    "textures": {"source": "images", "sampler": "samplers"},
    "images": {"bufferView": "bufferViews"},
    "samplers": {},
    "cameras": {},
    "materials": {},
    "meshes": {},
    "tracks": {"input": "accessors", "output": "accessors"},
}


def join(files: list[str]) -> tuple[Gltf, bytes]:
    """Numbers that refer to something move by how many of it there are already."""
    kinds = [kind for kind in REFERENCES if kind not in ("primitives", "tracks")]
    whole: Gltf = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], **{kind: [] for kind in kinds}}
    animation: Gltf = {"name": "All", "samplers": [], "channels": []}
    data = bytearray()
    for file in files:
        path, _, name = file.partition(":")
        part, more = read(path)
        by = {kind: len(whole[kind]) for kind in kinds}
        played = [one for one in part.get("animations", []) if not name or one.get("name") == name][:1]
        for one in played:
            for channel in one["channels"]:
                target = {**channel["target"], "node": channel["target"]["node"] + by["nodes"]}
                animation["channels"].append({"sampler": channel["sampler"] + len(animation["samplers"]), "target": target})
            animation["samplers"] += [moved(track, "tracks", by) for track in one["samplers"]]
        whole["scenes"][0]["nodes"] += shifted(part["scenes"][part.get("scene", 0)]["nodes"], by["nodes"])
        for view in part["bufferViews"]:
            view["byteOffset"] = view.get("byteOffset", 0) + len(data)
        for mesh in part["meshes"]:
            mesh["primitives"] = [moved(primitive, "primitives", by) for primitive in mesh["primitives"]]
        part["materials"] = [with_textures(material, by["textures"]) for material in part.get("materials", [])]
        for kind in kinds:
            whole[kind] += [moved(one, kind, by) for one in part.get(kind, [])]
        data += more + bytes(-len(more) % 4)
    whole |= {"animations": [animation], "buffers": [{"byteLength": len(data)}]}
    return {key: value for key, value in whole.items() if value != []}, bytes(data)


def moved(one: Gltf, kind: str, by: dict[str, int]) -> Gltf:
    refers = REFERENCES[kind]
    return {key: shifted(value, by[refers[key]]) if key in refers else value for key, value in one.items()}


def shifted(value: Any, by: int) -> Any:
    """A number, numbers in a row, or numbers with names."""
    if isinstance(value, list):
        return [shifted(one, by) for one in value]
    if isinstance(value, dict):
        return {key: shifted(one, by) for key, one in value.items()}
    return value + by


def with_textures(material: Any, by: int) -> Any:
    """Wherever a material names a texture, it is by `index`."""
    if isinstance(material, list):
        return [with_textures(one, by) for one in material]
    if not isinstance(material, dict):
        return material
    return {key: one + by if key == "index" else with_textures(one, by) for key, one in material.items()}


def write(path: Path, document: Gltf, data: bytes) -> None:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    path.write_bytes(struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks)


if __name__ == "__main__":
    main()
