//! How much of a surface a pixel sees: the ray as a thin cone (Akenine-Möller et al. 2021, "Improved Shader and Texture Level of Detail
//! Using Ray Cones", JCGT 10(1); the formula is from their chapter 20 of Ray Tracing Gems, 2019).
//!
//! ```text
//! W = w₀ + γ · distance                                     width of the cone where it hits
//! λ = ½ log₂( texels · A_uv / A · W² / |n·d| )              which copy of the picture has one texel per pixel
//! ```
//!
//! A and A_uv: the triangle's area in the world and in the picture. Differs from the paper: |n·d| is not squared, so that a texel is as large
//! as what a pixel sees, not as long. At grazing angles that is sharper than one sample should be, and smoother than a point; a pixel at
//! rest is the mean of many samples, which smooth what is left.
//!
//! Mirrors and glass pass a cone on as it is, whatever their curvature:
//! a curved one shows textures sharper than it might. A rough surface widens it, see [`Cone::scattered`].

/// A ray's width along its way.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Cone {
    /// At the ray's origin, in metres.
    pub(crate) width_m: f32,
    /// Metres of width per metre of way.
    pub(crate) spread: f32,
}

impl Cone {
    /// The cone after a ray of that length.
    #[inline]
    pub(crate) fn after(self, way_m: f32) -> Cone {
        Cone { width_m: self.width_m + self.spread * way_m, ..self }
    }

    /// The cone of a path that a surface of that α (the square of its roughness; 1: matte) sent on. Its rays are spread over a lobe about
    /// 2α wide; a tenth of that is far less than what one picks out of it, and enough to look distant textures up in small copies.
    #[inline]
    pub(crate) fn scattered(self, alpha: f32) -> Cone {
        const PART_OF_LOBE: f32 = 0.2;
        Cone { spread: self.spread.max(PART_OF_LOBE * alpha), ..self }
    }
}
