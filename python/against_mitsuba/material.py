"""The material of glTF 2.0 (specification, appendix B) for Mitsuba, written from the formulas and not from our renderer.

    f = F D V + (1 - metallic) base k / pi            F = mix(F_dielectric, F_metal, metallic)
    D = a^2 / (pi ((n.h)^2 (a^2 - 1) + 1)^2)          a = roughness^2
    V = 1 / 2 / (n.i sqrt(a^2 + (1 - a^2) (n.o)^2) + n.o sqrt(a^2 + (1 - a^2) (n.i)^2))
    F = F0 + (F90 - F0) (1 - h.i)^5                   F0 = 0.04 specular, F90 = specular; of metal base, 1
    k = 1 - F_dielectric(h.i)                         as the specification has it: `coupling` "half"
    k = (1 - F(n.o)) (1 - F(n.i)) / (1 - F mean)      as docs/materials.md has it: "both", which makes no light

Mitsuba samples it in the simplest way: half of the directions by the cosine, half by D. Surfaces have two sides.
"""

from typing import Any

import drjit
import mitsuba

mi: Any = mitsuba
dr: Any = drjit

SMOOTHEST = 2e-3
"""Of a; a mirror has none, and is in none of the scenes that are compared."""


class Metallic(mi.BSDF):  # type: ignore[misc]
    """`base_color`, `metallic_roughness` (green: roughness, blue: metallic), `normal`: textures; factors beside them."""

    def __init__(self, props: Any) -> None:
        super().__init__(props)
        self.base_color = props.get_texture("base_color")
        self.metallic_roughness = props.get_texture("metallic_roughness")
        self.normal = props.get_texture("normal") if "normal" in props else None
        self.metallic, self.roughness = props["metallic"], props["roughness"]
        self.specular = props.get("specular", 1.0)
        self.coupling = props.get("coupling", "both")
        glossy = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [glossy]
        self.m_flags = glossy

    def frame(self, si: Any, active: Any) -> Any:
        """That of the normal map in the frame of the surface, on the front."""
        if self.normal is None:
            return mi.Frame3f(mi.Normal3f(0, 0, 1))
        texel = 2 * mi.Vector3f(self.normal.eval_3(si, active)) - 1
        tangent = si.to_local(si.shape.eval_attribute_3("vertex_tangent", si, active))
        tangent = dr.normalize(mi.Vector3f(tangent.x, tangent.y, 0))
        bitangent = si.shape.eval_attribute_1("vertex_handed", si, active) * mi.Vector3f(-tangent.y, tangent.x, 0)
        return mi.Frame3f(mi.Normal3f(dr.normalize(texel.x * tangent + texel.y * bitangent + texel.z * mi.Vector3f(0, 0, 1))))

    def look_up(self, si: Any, active: Any) -> tuple[Any, Any, Any]:
        """Base colour, metallic, a."""
        base = mi.Color3f(self.base_color.eval(si, active))
        texel = mi.Color3f(self.metallic_roughness.eval_3(si, active))
        roughness = self.roughness * texel.y
        return base, self.metallic * texel.z, dr.maximum(roughness * roughness, SMOOTHEST)

    def parts(self, si: Any, wo: Any, active: Any) -> tuple[Any, Any, Any]:
        """Directions in the frame of the bent normal, and whether both are above it."""
        # Of a back everything is mirrored, and looks like a front.
        side = mi.Vector3f(1, 1, dr.sign(si.wi.z))
        frame = self.frame(si, active)
        i, o = frame.to_local(si.wi * side), frame.to_local(wo * side)
        return i, o, active & (si.wi.z * wo.z > 0) & (i.z > 0) & (o.z > 0)

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
        i, o, active = self.parts(si, wo, active)
        base, metallic, a = self.look_up(si, active)
        h = dr.normalize(i + o)
        a2 = a * a
        d = a2 / (dr.pi * dr.square(dr.square(h.z) * (a2 - 1) + 1))
        length_i, length_o = (dr.sqrt(a2 + (1 - a2) * dr.square(w.z)) for w in (i, o))
        v = 0.5 / (o.z * length_i + i.z * length_o)
        dielectric, metal = self.dielectric(dr.dot(h, i)), schlick(base, 1.0, dr.dot(h, i))
        fresnel = dr.lerp(mi.Color3f(dielectric), metal, metallic)
        value = fresnel * d * v + (1 - metallic) * base * self.below(i, o, h) * dr.inv_pi
        pdf = 0.5 * o.z * dr.inv_pi + 0.5 * d * h.z / (4 * dr.dot(h, o))
        return dr.select(active, value * o.z, 0), dr.select(active, pdf, 0)

    def dielectric(self, cos: Any) -> Any:
        return schlick(0.04 * self.specular, self.specular, cos)

    def below(self, i: Any, o: Any, h: Any) -> Any:
        """k."""
        if self.coupling == "half":
            return 1 - self.dielectric(dr.dot(h, i))
        mean = self.specular * (0.04 + 0.96 / 21)
        return (1 - self.dielectric(i.z)) * (1 - self.dielectric(o.z)) / (1 - mean)

    def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        return self.eval_pdf(ctx, si, wo, active)[1]

    def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> tuple[Any, Any]:
        _, _, a = self.look_up(si, active)
        side = mi.Vector3f(1, 1, dr.sign(si.wi.z))
        frame = self.frame(si, active)
        i = frame.to_local(si.wi * side)
        # cos of the angle between n and h: u of D cos.
        cos2 = (1 - sample2.x) / (1 + (a * a - 1) * sample2.x)
        sin, (sin_phi, cos_phi) = dr.safe_sqrt(1 - cos2), dr.sincos(dr.two_pi * sample2.y)
        h = mi.Vector3f(sin * cos_phi, sin * sin_phi, dr.sqrt(cos2))
        o = dr.select(sample1 < 0.5, mi.warp.square_to_cosine_hemisphere(sample2), 2 * dr.dot(i, h) * h - i)
        wo = frame.to_world(o) * side
        value, pdf = self.eval_pdf(ctx, si, wo, active)
        sample = mi.BSDFSample3f()
        sample.wo, sample.pdf, sample.eta = wo, pdf, 1.0
        sample.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        sample.sampled_component = mi.UInt32(0)
        return sample, dr.select(pdf > 0, value / pdf, 0)

    def traverse(self, callback: Any) -> None:
        callback.put("base_color", self.base_color, mi.ParamFlags.Differentiable)

    def to_string(self) -> str:
        return f"Metallic[metallic={self.metallic}, roughness={self.roughness}]"


def schlick(f0: Any, f90: Any, cos: Any) -> Any:
    x = 1 - cos
    return f0 + (f90 - f0) * dr.square(dr.square(x)) * x


mi.register_bsdf("metallic", Metallic)
