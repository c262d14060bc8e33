//! Texture look-up.

mod cone;
mod mip;

use frameless_scene::{Filter, Image, Minify, Texture, Wrap};
use glam::Vec4;

pub(crate) use cone::Cone;
pub(crate) use frameless_scene::Encoding;
pub(crate) use mip::Copies;

/// Whether it matters how much of the picture a pixel sees.
pub(crate) fn depends_on_distance(texture: &Texture) -> bool {
    texture.minify.levels.is_some() || texture.minify.filter != texture.filter
}

/// A picture with its smaller copies, and how both are looked up.
#[derive(Clone, Copy)]
pub(crate) struct Lookup<'a> {
    pub(crate) texture: &'a Texture,
    pub(crate) image: &'a Image,
    pub(crate) copies: &'a Copies,
    pub(crate) encoding: Encoding,
}

impl Lookup<'_> {
    /// RGBA at texture coordinates `uv`; (0, 0) is the top-left corner of the first texel. `level`: log₂ of how many texels a pixel
    /// is wide, for textures that [depend on it](depends_on_distance).
    ///
    /// Texels are decoded before they are mixed.
    #[inline]
    pub(crate) fn at(&self, uv: [f32; 2], level: f32) -> Vec4 {
        let table = self.encoding.table();
        self.at_by(uv, level, |[r, g, b, a]| {
            let [r, g, b] = [r, g, b].map(|code| table[usize::from(code)]);
            Vec4::new(r, g, b, f32::from(a) * (1.0 / 255.0))
        })
    }

    /// The last of these numbers, to the last bit: a ray may pass a thousand masked leaves, of which nothing else is asked.
    #[inline]
    pub(crate) fn alpha_at(&self, uv: [f32; 2], level: f32) -> f32 {
        self.at_by(uv, level, |[.., a]| Vec4::W * (f32::from(a) * (1.0 / 255.0))).w
    }

    #[inline(always)]
    fn at_by(&self, uv: [f32; 2], level: f32, decode: impl Fn([u8; 4]) -> Vec4) -> Vec4 {
        // Also where the level is no number.
        if level <= 0.0 || level.is_nan() {
            return self.texel(self.image, self.texture.filter, uv, decode);
        }
        let Minify { filter, levels } = self.texture.minify;
        let Some(between) = levels else { return self.texel(self.image, filter, uv, decode) };
        let copies = self.copies.of(self.texture.image, self.encoding);
        let copy = |number: usize| match number {
            0 => self.texel(self.image, filter, uv, &decode),
            number => self.texel(&copies[number - 1], filter, uv, &decode),
        };
        let level = level.min(copies.len() as f32);
        match between {
            Filter::Nearest => copy((level + 0.5) as usize),
            Filter::Linear => {
                let (finer, part) = (level as usize, level.fract());
                if part == 0.0 { copy(finer) } else { copy(finer).lerp(copy(finer + 1), part) }
            }
        }
    }

    #[inline]
    fn texel(
        &self,
        image: &Image,
        filter: Filter,
        uv: [f32; 2],
        decode: impl Fn([u8; 4]) -> Vec4,
    ) -> Vec4 {
        // As pictures are that are all of one colour, which is not to change where it is mixed with itself.
        if let [only] = image.rgba[..] {
            return decode(only);
        }
        let [wrap_u, wrap_v] = self.texture.wrap;
        let (width, height) = (image.width as i32, image.height as i32);
        let x = into_unit(uv[0], wrap_u) * width as f32;
        let y = into_unit(uv[1], wrap_v) * height as f32;
        let texel = |x: i32, y: i32| {
            let x = neighbour(x, width, wrap_u);
            let y = neighbour(y, height, wrap_v);
            decode(image.rgba[y as usize * width as usize + x as usize])
        };
        match filter {
            Filter::Nearest => texel(x as i32, y as i32),
            Filter::Linear => {
                // Texel centres are at half numbers.
                let (x, y) = (x - 0.5, y - 0.5);
                let (left, top) = (x.floor(), y.floor());
                let (fx, fy) = (x - left, y - top);
                let (i, j) = (left as i32, top as i32);
                let above = texel(i, j).lerp(texel(i + 1, j), fx);
                let below = texel(i, j + 1).lerp(texel(i + 1, j + 1), fx);
                above.lerp(below, fy)
            }
        }
    }
}

/// A coordinate brought into [0, 1]; not finite becomes 0.
#[inline(always)]
fn into_unit(c: f32, wrap: Wrap) -> f32 {
    if !c.is_finite() {
        return 0.0;
    }
    match wrap {
        Wrap::Repeat => c - c.floor(),
        Wrap::MirroredRepeat => {
            let in_pair = c - 2.0 * (0.5 * c).floor();
            if in_pair > 1.0 { 2.0 - in_pair } else { in_pair }
        }
        Wrap::ClampToEdge => c.clamp(0.0, 1.0),
    }
}

/// A texel index from −1 to `size` brought into the image. The mirrored image's neighbour at the border is the border
/// texel itself, as when clamped.
#[inline(always)]
fn neighbour(index: i32, size: i32, wrap: Wrap) -> i32 {
    match wrap {
        Wrap::Repeat if index < 0 => size - 1,
        Wrap::Repeat if index >= size => 0,
        _ => index.clamp(0, size - 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use frameless_scene::{Material, Scene, TextureRef};

    /// Black and white beside each other.
    fn look_with(u: f32, wrap: Wrap, filter: Filter, minify: Minify, level: f32) -> f32 {
        let image = Image { width: 2, height: 1, rgba: vec![[0, 0, 0, 255], [255; 4]] };
        let texture = Texture { image: 0, wrap: [wrap; 2], filter, minify };
        let mut scene = Scene { images: vec![image], textures: vec![texture], ..Scene::default() };
        scene.materials.push(Material {
            base_color_texture: Some(TextureRef::plain(0)),
            ..Material::default()
        });
        let copies = Copies::new(&scene);
        let encoding = Encoding::Color;
        let (texture, image) = (&scene.textures[0], &scene.images[0]);
        Lookup { texture, image, copies: &copies, encoding }.at([u, 0.5], level).x
    }

    fn look(u: f32, wrap: Wrap, filter: Filter) -> f32 {
        look_with(u, wrap, filter, Minify::default(), 0.0)
    }

    #[test]
    fn filters_for_small_pictures_are_respected() {
        let at = |filter, levels, level| {
            let minify = Minify { filter, levels };
            look_with(0.9, Wrap::ClampToEdge, Filter::Linear, minify, level)
        };
        let mean = 0.5029;
        for (filter, levels, level, expected) in [
            (Filter::Nearest, None, 5.0, 1.0),
            (Filter::Linear, Some(Filter::Nearest), 0.4, 1.0),
            (Filter::Linear, Some(Filter::Nearest), 0.6, mean),
            (Filter::Linear, Some(Filter::Linear), 0.5, 0.5 * (1.0 + mean)),
            (Filter::Linear, Some(Filter::Linear), 1.0, mean),
            (Filter::Linear, Some(Filter::Linear), f32::INFINITY, mean),
            (Filter::Linear, Some(Filter::Linear), f32::NAN, 1.0),
            (Filter::Linear, Some(Filter::Linear), -3.0, 1.0),
        ] {
            let came = at(filter, levels, level);
            assert!((came - expected).abs() < 1e-3, "{filter:?} {levels:?} {level}: {came}");
        }
    }

    #[test]
    fn between_texel_centres_light_is_mixed_linearly() {
        for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
            assert_eq!(look(0.25, wrap, Filter::Linear), 0.0);
            assert_eq!(look(0.75, wrap, Filter::Linear), 1.0);
            assert_eq!(look(0.5, wrap, Filter::Linear), 0.5);
        }
    }

    #[test]
    fn outside_follows_the_wrap_mode() {
        let at = |u, wrap| look(u, wrap, Filter::Linear);
        assert_eq!(at(0.0, Wrap::Repeat), 0.5, "half the texel before, which is the last one");
        assert_eq!(at(0.0, Wrap::ClampToEdge), 0.0);
        assert_eq!(at(0.0, Wrap::MirroredRepeat), 0.0);
        assert_eq!(at(1.25, Wrap::Repeat), 0.0);
        assert_eq!(at(1.25, Wrap::ClampToEdge), 1.0);
        assert_eq!(at(1.25, Wrap::MirroredRepeat), 1.0);
        assert_eq!(at(-0.75, Wrap::MirroredRepeat), 1.0);
        assert_eq!(at(-0.75, Wrap::Repeat), 0.0);
    }

    #[test]
    fn alpha_alone_is_the_same() {
        let texel = |k: u32| [k * 7 % 256, k * 13 % 256, 0, k * 31 % 256].map(|x| x as u8);
        let rgba = (0..16).map(texel).collect();
        let scene = Scene {
            images: vec![Image { width: 4, height: 4, rgba }],
            textures: vec![Texture {
                image: 0,
                wrap: [Wrap::Repeat; 2],
                filter: Filter::Linear,
                minify: Minify::TRILINEAR,
            }],
            materials: vec![Material {
                base_color_texture: Some(TextureRef::plain(0)),
                ..Material::default()
            }],
            ..Scene::default()
        };
        let (copies, encoding) = (Copies::new(&scene), Encoding::Color);
        let (texture, image) = (&scene.textures[0], &scene.images[0]);
        let lookup = Lookup { texture, image, copies: &copies, encoding };
        for k in 0..100 {
            let (uv, level) = ([k as f32 * 0.037, k as f32 * 0.111], k as f32 * 0.05 - 1.0);
            assert_eq!(lookup.alpha_at(uv, level), lookup.at(uv, level).w, "{k}");
        }
    }

    /// Mixed with itself by rounded weights it would be off by the last bit here and there.
    #[test]
    fn a_single_texel_is_what_it_is() {
        for encoding in Encoding::BOTH {
            for byte in 0..=255 {
                let image = Image { width: 1, height: 1, rgba: vec![[byte; 4]] };
                let texture = Texture {
                    image: 0,
                    wrap: [Wrap::Repeat; 2],
                    filter: Filter::Linear,
                    minify: Minify::TRILINEAR,
                };
                let copies =
                    Copies::new(&Scene { images: vec![image.clone()], ..Scene::default() });
                let lookup = Lookup { texture: &texture, image: &image, copies: &copies, encoding };
                let light = encoding.table()[usize::from(byte)];
                let expected = Vec4::new(light, light, light, f32::from(byte) * (1.0 / 255.0));
                for k in 0..9 {
                    let uv = [k as f32 * 0.137, k as f32 * 0.211];
                    assert_eq!(lookup.at(uv, k as f32 - 4.0), expected, "{byte}");
                }
            }
        }
    }

    #[test]
    fn nearest_takes_one_texel() {
        assert_eq!(look(0.49, Wrap::Repeat, Filter::Nearest), 0.0);
        assert_eq!(look(0.51, Wrap::Repeat, Filter::Nearest), 1.0);
        assert_eq!(look(1.0, Wrap::ClampToEdge, Filter::Nearest), 1.0);
    }

    #[test]
    fn absurd_coordinates_give_a_texel() {
        for u in [f32::NAN, f32::INFINITY, -1e38, 1e38, -1e-30] {
            for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
                for filter in [Filter::Nearest, Filter::Linear] {
                    assert!((0.0..=1.0).contains(&look(u, wrap, filter)));
                }
            }
        }
    }
}
