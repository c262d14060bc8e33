"""What is done to files before two renderers are given them: the public ones have neither lamps nor, some of them, a camera."""

from pathlib import Path

import numpy as np

from gltf import Array, Gltf, Json, local

POINT_LIGHT = "KHR_lights_punctual"
SPECULAR = "KHR_materials_specular"


def stand(gltf: Gltf, node: Json) -> int:
    """Puts a node into the scene that is shown."""
    json = gltf.json
    json["nodes"].append(node)
    json["scenes"][json.get("scene", 0)]["nodes"].append(len(json["nodes"]) - 1)
    return len(json["nodes"]) - 1


def add_camera(gltf: Gltf, eye: Array, target: Array, yfov: float) -> None:
    """The only camera from now on, in radians and metres."""
    backward = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross([0.0, 1.0, 0.0], backward)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.stack([right, np.cross(backward, right), backward, eye], axis=1)
    for node in gltf.json["nodes"]:
        node.pop("camera", None)
    gltf.json["cameras"] = [{"type": "perspective", "perspective": {"yfov": yfov, "znear": 0.01}}]
    stand(gltf, {"camera": 0, "matrix": matrix.T.ravel().tolist()})


def add_point_light(gltf: Gltf, position: list[float], intensity: float) -> None:
    """In W/sr, as both renderers count."""
    light = {"type": "point", "intensity": intensity}
    gltf.json.setdefault("extensions", {})[POINT_LIGHT] = {"lights": [light]}
    gltf.json.setdefault("extensionsUsed", []).append(POINT_LIGHT)
    stand(gltf, {"translation": position, "extensions": {POINT_LIGHT: {"light": 0}}})


def add_lamp(gltf: Gltf, centre: list[float], side: float, radiance: list[float]) -> None:
    """A square under the ceiling that shines downwards."""
    json, half = gltf.json, side / 2
    corners = np.array([[-half, 0, -half], [half, 0, -half], [half, 0, half], [-half, 0, half]], np.float32)
    json["materials"].append({"name": "lamp", "pbrMetallicRoughness": {"metallicFactor": 0}})
    glow(gltf, len(json["materials"]) - 1, radiance)
    primitive = {
        "attributes": {"POSITION": gltf.add_array(corners)},
        "indices": gltf.add_array(np.array([0, 1, 2, 0, 2, 3], np.uint32)),
        "material": len(json["materials"]) - 1,
    }
    json["meshes"].append({"primitives": [primitive]})
    stand(gltf, {"name": "lamp", "mesh": len(json["meshes"]) - 1, "translation": centre})


def glow(gltf: Gltf, material: int, radiance: list[float]) -> None:
    """A material of that radiance."""
    strength = max(radiance)
    gltf.json["materials"][material] |= {
        "emissiveFactor": [part / strength for part in radiance],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": strength}},
    }
    gltf.json.setdefault("extensionsUsed", []).append("KHR_materials_emissive_strength")


def make_matte(gltf: Gltf) -> None:
    """Every material scatters its base colour evenly, and does nothing else: no metal, no highlight."""
    gltf.json.setdefault("extensionsUsed", []).append(SPECULAR)
    for material in gltf.json.setdefault("materials", []):
        pbr = material.setdefault("pbrMetallicRoughness", {})
        pbr["metallicFactor"] = 0
        pbr.pop("metallicRoughnessTexture", None)
        material.pop("normalTexture", None)
        material.setdefault("extensions", {})[SPECULAR] = {"specularFactor": 0}


def jump(gltf: Gltf, name: str, by: list[float], secs: float) -> None:
    """The node of that name jumps, in its parent's coordinates."""
    json = gltf.json
    number = next(number for number, node in enumerate(json["nodes"]) if node.get("name") == name)
    place = local(json["nodes"][number])[:3, 3]
    times = gltf.add_array(np.array([0.0, secs], np.float32))
    places = gltf.add_array(np.array([place, place + by], np.float32))
    sampler = {"input": times, "output": places, "interpolation": "STEP"}
    channel = {"sampler": 0, "target": {"node": number, "path": "translation"}}
    json["animations"] = [{"samplers": [sampler], "channels": [channel]}]


def cornell(scenes: Path, lit_by: str) -> Gltf:
    """The box with its lamp switched on, or with a point light below it; the camera is the file's, which stands before the open side."""
    gltf = Gltf(scenes / "architecture/CornellBox.glb").changed()
    if lit_by == "lamp":
        names = [material["name"] for material in gltf.json["materials"]]
        glow(gltf, names.index("light.000"), [17.0, 12.0, 8.0])
    else:
        add_point_light(gltf, [0.0, 2.9, 0.0], 8.0)
    return gltf


def bottle(scenes: Path) -> Gltf:
    """Seen from its front and a little above. Its textures are looked up in full size by both, and nothing on it glows."""
    gltf = Gltf(scenes / "pbr/WaterBottle-1k.glb").changed()
    add_camera(gltf, np.array([0.16, 0.08, 0.26]), np.zeros(3), 0.7)
    for material in gltf.json["materials"]:
        material.pop("emissiveTexture"), material.pop("emissiveFactor")
    sharp = {"minFilter": 9729, "magFilter": 9729}
    gltf.json["samplers"] = [sharp]
    for texture in gltf.json["textures"]:
        texture["sampler"] = 0
    return gltf


def bathroom(scenes: Path, lit_by: str) -> Gltf:
    """A lamp under its ceiling; the camera is the file's, which stands in a corner."""
    gltf = Gltf(scenes / "architecture/Bathroom/LAZIENKA.gltf").changed()
    light(gltf, lit_by, [0.0, 2.3, 4.2], 0.8, 14.0)
    return gltf


def apartment(scenes: Path, lit_by: str) -> Gltf:
    """Seen from above, as it has no ceiling; the lamp is above it. Its one mesh is taken apart by materials, so that parts can move."""
    gltf = Gltf(scenes / "architecture/DreamApartment.glb").changed()
    take_apart(gltf)
    add_camera(gltf, np.array([6.6, 7.5, 2.5]), np.array([6.6, 0.0, -5.5]), 0.9)
    light(gltf, lit_by, [6.6, 6.0, -5.5], 3.0, 9.0)
    return gltf


def light(gltf: Gltf, lit_by: str, place: list[float], side: float, radiance: float) -> None:
    """A lamp, or a point of as much light straight down."""
    if lit_by == "lamp":
        add_lamp(gltf, place, side, [radiance] * 3)
    else:
        add_point_light(gltf, place, radiance * side * side)


def take_apart(gltf: Gltf) -> None:
    """Every primitive becomes a mesh and a node of its own, named like its material."""
    json = gltf.json
    (mesh,), (node,) = json["meshes"], json["nodes"]
    json["meshes"] = [{"primitives": [primitive]} for primitive in mesh["primitives"]]
    names = [json["materials"][primitive["material"]]["name"] for primitive in mesh["primitives"]]
    json["nodes"] = [{**node, "mesh": number, "name": name} for number, name in enumerate(names)]
    json["scenes"][0]["nodes"] = list(range(len(names)))
