"""A glTF file as a scene of Mitsuba's, whose variant has been chosen by then."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mitsuba
import numpy as np

from gltf import Array, Gltf, Json, Placed

mi: Any = mitsuba

Materials = Callable[[Gltf, Json], Json]


def scene(gltf: Gltf, materials: Materials, environment: Path | None = None) -> Any:
    """`materials`: from a material of the file to one of Mitsuba's."""
    world: Json = {"type": "scene"}
    made: dict[int | None, Any] = {}
    for number, placed in enumerate(gltf.primitives()):
        index = placed.primitive.get("material")
        described = gltf.json["materials"][index] if index is not None else {}
        if index not in made:
            made[index] = mi.load_dict(materials(gltf, described))
        world[f"mesh{number}"] = mesh(gltf, placed, made[index], radiance(described))
    for number, (position, intensity) in enumerate(point_lights(gltf)):
        colour = {"type": "rgb", "value": intensity}
        world[f"light{number}"] = {"type": "point", "position": position, "intensity": colour}
    if environment:
        world["environment"] = sky(environment)
    return mi.load_dict(world)


def sensor(gltf: Gltf, size: tuple[int, int]) -> Any:
    """The file's camera; every pixel is the mean of what it sees."""
    world, yfov = gltf.camera()
    # Mitsuba's looks along +z, with x to the left.
    matrix = world @ np.diag([-1.0, 1.0, -1.0, 1.0])
    width, height = size
    film = {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}, "component_format": "float32"}
    transform = mi.ScalarTransform4f(matrix)
    angle = {"fov": float(np.degrees(yfov)), "fov_axis": "y", "near_clip": 1e-3, "far_clip": 1e4}
    return mi.load_dict({"type": "perspective", "to_world": transform, **angle, "film": {**film, "pixel_format": "rgb"}})


def mesh(gltf: Gltf, placed: Placed, bsdf: Any, light: list[float] | None) -> Any:
    """In world coordinates."""
    attributes = placed.primitive["attributes"]
    matrix = placed.world[:3, :3]
    position = gltf.accessor(attributes["POSITION"]) @ matrix.T + placed.world[:3, 3]
    count = len(position)
    indices = gltf.accessor(placed.primitive["indices"])[:, 0] if "indices" in placed.primitive else np.arange(count)
    if np.linalg.det(matrix) < 0:
        # What is mirrored is wound the other way.
        indices = indices.reshape(-1, 3)[:, ::-1]
    has_normals, has_uv = "NORMAL" in attributes, "TEXCOORD_0" in attributes
    props = mi.Properties()
    props["bsdf"] = bsdf
    if light:
        props["emitter"] = mi.load_dict({"type": "area", "radiance": {"type": "rgb", "value": light}})
    made = mi.Mesh(placed.name, count, indices.size // 3, props=props, has_vertex_normals=has_normals, has_vertex_texcoords=has_uv)
    if "TANGENT" in attributes:
        tangent = gltf.accessor(attributes["TANGENT"])
        made.add_attribute("vertex_tangent", 3, (tangent[:, :3] @ matrix.T).astype(np.float32).ravel())
        made.add_attribute("vertex_handed", 1, (np.sign(np.linalg.det(matrix)) * tangent[:, 3]).astype(np.float32))
    parameters = mi.traverse(made)
    parameters["vertex_positions"] = position.astype(np.float32).ravel()
    parameters["faces"] = indices.astype(np.uint32).ravel()
    if has_normals:
        normal = gltf.accessor(attributes["NORMAL"]) @ np.linalg.inv(matrix)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        parameters["vertex_normals"] = normal.astype(np.float32).ravel()
    if has_uv:
        parameters["vertex_texcoords"] = gltf.accessor(attributes["TEXCOORD_0"]).astype(np.float32).ravel()
    parameters.update()
    return made


def radiance(material: Json) -> list[float] | None:
    """What an even lamp gives off; textures of what glows are not compared."""
    factor = np.array(material.get("emissiveFactor", [0, 0, 0]), float)
    strength = material.get("extensions", {}).get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
    return (strength * factor).tolist() if factor.any() and "emissiveTexture" not in material else None


def point_lights(gltf: Gltf) -> list[tuple[list[float], list[float]]]:
    """Where they are, and their radiant intensity."""
    lights = gltf.json.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
    found = []
    for node, world in gltf.placed():
        index = node.get("extensions", {}).get("KHR_lights_punctual", {}).get("light")
        if index is not None:
            colour = np.array(lights[index].get("color", [1, 1, 1])) * lights[index].get("intensity", 1.0)
            found.append((world[:3, 3].tolist(), colour.tolist()))
    return found


def sky(path: Path) -> Any:
    """Ours has +x in the middle column, Mitsuba's -z at the left edge: a quarter of the picture apart."""
    picture = np.array(mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32))
    picture = np.roll(picture, -(picture.shape[1] // 4), axis=1)
    return mi.load_dict({"type": "envmap", "bitmap": mi.Bitmap(picture)})


def matte(gltf: Gltf, material: Json) -> Json:
    """Mitsuba's own Lambertian surface; right where the file has been made matte."""
    pbr = material.get("pbrMetallicRoughness", {})
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": base_color(gltf, pbr)}}


def metallic(gltf: Gltf, material: Json) -> Json:
    """The whole of it; see material.py."""
    pbr = material.get("pbrMetallicRoughness", {})
    number = pbr.get("metallicRoughnessTexture")
    described: Json = {
        "type": "metallic",
        "base_color": base_color(gltf, pbr),
        "metallic_roughness": picture(gltf, number, True) if number else grey(1.0),
        "metallic": float(pbr.get("metallicFactor", 1.0)),
        "roughness": float(pbr.get("roughnessFactor", 1.0)),
        "specular": float(material.get("extensions", {}).get("KHR_materials_specular", {}).get("specularFactor", 1.0)),
    }
    if "normalTexture" in material:
        described["normal"] = picture(gltf, material["normalTexture"], True)
    return described


def as_specified(gltf: Gltf, material: Json) -> Json:
    """The same with the specification's own way from highlight to matte, which ours leaves: what is found with it tells how far that is."""
    return {**metallic(gltf, material), "coupling": "half"}


def base_color(gltf: Gltf, pbr: Json) -> Json:
    factor = pbr.get("baseColorFactor", [1, 1, 1, 1])[:3]
    if "baseColorTexture" not in pbr:
        return {"type": "rgb", "value": list(factor)}
    if list(factor) != [1, 1, 1]:
        raise ValueError(f"a texture times {factor}: none of the scenes that are compared has that")
    return picture(gltf, pbr["baseColorTexture"], False)


def picture(gltf: Gltf, reference: Json, is_number: bool) -> Json:
    """Bilinear between texel centres, repeated."""
    image = gltf.json["images"][gltf.json["textures"][reference["index"]]["source"]]
    bitmap = decoded(gltf.bytes_of(image))
    if bitmap.pixel_format() != mi.Bitmap.PixelFormat.RGB:
        bitmap = bitmap.convert(mi.Bitmap.PixelFormat.RGB, bitmap.component_format(), bitmap.srgb_gamma())
    return {"type": "bitmap", "bitmap": bitmap, "raw": is_number}


def decoded(content: bytes) -> Any:
    """A PNG or JPEG file's picture."""
    stream = mi.MemoryStream(len(content))
    stream.write(content)
    stream.seek(0)
    return mi.Bitmap(stream)


def grey(value: float) -> Json:
    return {"type": "bitmap", "bitmap": mi.Bitmap(np.full((1, 1, 3), value, np.float32)), "raw": True}


def linear(image: Any) -> Array:
    """float64, shape (height, width, 3)."""
    return np.array(image, dtype=np.float64)
