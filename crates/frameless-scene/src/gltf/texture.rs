//! Textures: an image, and how it is looked up. Only images that a material shows are decoded, each once.

use std::collections::HashMap;

use glam::Vec2;

use crate::{Encoding, Filter, Image, Material, Minify, Texture, TextureRef, UV_SETS, Wrap};

use super::buffers::View;
use super::decode::Decoded;
use super::document::Document;
use super::error::Fault;
use super::image::{Encoded, FileImage};
use super::json::Json;
use super::room::{Pictures, decode_all};

/// The file's textures, and those that the scene has got so far.
pub(super) struct Textures<'a> {
    file_images: Vec<FileImage<'a>>,
    /// Per image of the file: the first that is of the same bytes, which is perhaps itself.
    same_as: Vec<usize>,
    file_textures: Vec<FileTexture>,
    texture_of: HashMap<usize, u32>,
    image_of: HashMap<usize, u32>,
    /// Those that are shown, in the order of the scene's: number in the file, and the bytes if they may be decoded.
    shown: Vec<(usize, Result<Encoded, Fault>)>,
    pub(super) textures: Vec<Texture>,
}

/// A texture of the file; its references are in bounds.
#[derive(Clone, Copy)]
struct FileTexture {
    image: Option<usize>,
    sampler: Sampler,
}

/// How a picture is looked up.
#[derive(Clone, Copy)]
struct Sampler {
    wrap: [Wrap; 2],
    filter: Filter,
    minify: Minify,
}

impl<'a> Textures<'a> {
    pub(super) fn parse(root: &Json<'a>, views: &[View<'_>]) -> Result<Textures<'a>, Fault> {
        let images = root.list("images")?;
        let file_images = images.iter().map(|json| FileImage::parse(json, views.len()));
        let file_images = file_images.collect::<Result<Vec<_>, Fault>>()?;
        let same_as = same_as(&file_images, views);
        let samplers = root.list("samplers")?;
        let samplers = samplers.iter().map(parse_sampler).collect::<Result<Vec<_>, Fault>>()?;
        let textures = root.list("textures")?;
        let file_textures =
            textures.iter().map(|json| FileTexture::parse(json, &samplers, file_images.len()));
        Ok(Textures {
            file_textures: file_textures.collect::<Result<_, Fault>>()?,
            file_images,
            same_as,
            texture_of: HashMap::new(),
            image_of: HashMap::new(),
            shown: Vec::new(),
            textures: Vec::new(),
        })
    }

    /// The bytes of the file that its pictures are of, but for those of other files.
    pub(super) fn pieces<'v>(&self, views: &'v [View<'_>]) -> impl Iterator<Item = &'v [u8]> {
        let shown =
            self.file_images.iter().filter_map(|image| image.view()).map(|view| views[view]);
        shown.filter(|view| view.in_file).map(|view| view.bytes)
    }

    /// The texture that the member `key` of `holder` refers to, if it is there; `owner` is the material's.
    pub(super) fn refer(
        &mut self,
        holder: &Json<'_>,
        key: &str,
        owner: &str,
        document: &mut Document<'_>,
    ) -> Result<Option<TextureRef>, Fault> {
        let Some(info) = holder.field(key)? else { return Ok(None) };
        let file_texture = self.check(&info)?;
        let mut uv_set = info.unsigned_or("texCoord", 0)?;
        let mut reference = TextureRef::plain(0);
        if let Some(transform) = info.extension("KHR_texture_transform")? {
            uv_set = transform.unsigned_or("texCoord", uv_set)?;
            let offset = transform.numbers_or("offset", [0.0; 2])?;
            let scale = transform.numbers_or("scale", [1.0; 2])?;
            let rotation_rad = transform.number_or("rotation", 0.0)?;
            let [offset, scale] = [offset, scale].map(Vec2::from_array);
            reference.picture_from_uv = TextureRef::transform(offset, rotation_rad, scale);
        }
        if uv_set >= UV_SETS {
            let what = "textures with texture coordinates beyond set 3 are not drawn";
            document.warnings.about(what, owner);
            return Ok(None);
        }
        let texture = self.texture(file_texture, document);
        Ok(texture.map(|texture| TextureRef { texture, uv_set: uv_set as u32, ..reference }))
    }

    /// Refuses an `info` that refers to no texture; returns the index of the file's texture.
    fn check(&self, info: &Json<'_>) -> Result<usize, Fault> {
        info.required("index")?.index(self.file_textures.len(), "textures")
    }

    /// Refuses a member that refers to no texture, of those that are not drawn.
    pub(super) fn check_member(&self, holder: &Json<'_>, key: &str) -> Result<(), Fault> {
        holder.field(key)?.map_or(Ok(()), |info| self.check(&info).map(drop))
    }

    fn texture(&mut self, file_texture: usize, document: &mut Document<'_>) -> Option<u32> {
        if let Some(&known) = self.texture_of.get(&file_texture) {
            return Some(known);
        }
        let FileTexture { image, sampler } = self.file_textures[file_texture];
        let Some(image) = image else {
            let whom = format!("/textures/{file_texture}");
            document.warnings.about("textures without a readable image are not drawn", whom);
            return None;
        };
        let image = self.image(image, document);
        let index = self.textures.len() as u32;
        let Sampler { wrap, filter, minify } = sampler;
        self.textures.push(Texture { image, wrap, filter, minify });
        self.texture_of.insert(file_texture, index);
        Some(index)
    }

    fn image(&mut self, file_image: usize, document: &mut Document<'_>) -> u32 {
        let file_image = self.same_as[file_image];
        if let Some(&known) = self.image_of.get(&file_image) {
            return known;
        }
        let index = self.shown.len() as u32;
        self.shown.push((file_image, self.file_images[file_image].open(document)));
        self.image_of.insert(file_image, index);
        index
    }

    /// The pictures that are shown, as large as there is room for; checkers with a warning for those that cannot be decoded.
    pub(super) fn decode(
        &mut self,
        materials: &[Material],
        document: &mut Document<'_>,
    ) -> Vec<Image> {
        let shown = std::mem::take(&mut self.shown);
        let (numbers, encoded): (Vec<usize>, Vec<_>) = shown.into_iter().unzip();
        let encodings = self.encodings(materials, numbers.len());
        let Pictures { decoded, is_reduced, no_room } = decode_all(encoded, &encodings, document);
        let pictures = numbers.into_iter().zip(decoded).zip(is_reduced);
        let images = pictures.map(|((number, decoded), is_reduced)| {
            let file_image = &self.file_images[number];
            let Decoded { image, damage, .. } = match decoded {
                Ok(decoded) => decoded,
                Err(fault) => return file_image.stand_in(&fault, document),
            };
            damage.iter().for_each(|damage| file_image.warn_of_damage(damage, document));
            if let Some(fault) = no_room.as_ref().filter(|_| is_reduced) {
                file_image.warn_of_size(fault, document);
            }
            image
        });
        images.collect()
    }

    /// What the bytes of each picture mean: colours, if any material takes them for such.
    fn encodings(&self, materials: &[Material], images: usize) -> Vec<Encoding> {
        let mut encodings = vec![Encoding::Number; images];
        for (reference, is_color) in materials.iter().flat_map(Material::textures) {
            if is_color {
                let texture = self.textures[reference.texture as usize];
                encodings[texture.image as usize] = Encoding::Color;
            }
        }
        encodings
    }
}

/// Per image: the first that is of the same bytes, which is perhaps itself.
fn same_as(images: &[FileImage<'_>], views: &[View<'_>]) -> Vec<usize> {
    let mut known = HashMap::new();
    let mut same_as = Vec::with_capacity(images.len());
    for (index, image) in images.iter().enumerate() {
        let first = image.bytes(views).map(|bytes| *known.entry(bytes).or_insert(index));
        same_as.push(first.unwrap_or(index));
    }
    same_as
}

impl FileTexture {
    fn parse(
        json: &Json<'_>,
        samplers: &[Sampler],
        image_count: usize,
    ) -> Result<FileTexture, Fault> {
        let sampler = match json.field("sampler")? {
            Some(sampler) => samplers[sampler.index(samplers.len(), "samplers")?],
            None => Sampler {
                wrap: [Wrap::Repeat; 2],
                filter: Filter::Linear,
                minify: Minify::TRILINEAR,
            },
        };
        let mut image = None;
        let webp = json.extension("EXT_texture_webp")?;
        for holder in webp.iter().chain([json]) {
            if let Some(source) = holder.field("source")? {
                let source = source.index(image_count, "images")?;
                image = image.or(Some(source));
            }
        }
        Ok(FileTexture { image, sampler })
    }
}

fn parse_sampler(json: &Json<'_>) -> Result<Sampler, Fault> {
    let wrap = [parse_wrap(json, "wrapS")?, parse_wrap(json, "wrapT")?];
    let filter = match json.field("magFilter")? {
        None => Filter::default(),
        Some(filter) => match filter.unsigned()? {
            9728 => Filter::Nearest,
            9729 => Filter::Linear,
            _ => return Err(filter.fault("a filter: 9728 or 9729")),
        },
    };
    Ok(Sampler { wrap, filter, minify: parse_minify(json)? })
}

/// Names: how between texels, and how between levels (glTF 2.0 §3.8.4.1, with OpenGL's numbers).
fn parse_minify(json: &Json<'_>) -> Result<Minify, Fault> {
    use Filter::{Linear, Nearest};
    let Some(filter) = json.field("minFilter")? else { return Ok(Minify::TRILINEAR) };
    let (filter, levels) = match filter.unsigned()? {
        9728 => (Nearest, None),
        9729 => (Linear, None),
        9984 => (Nearest, Some(Nearest)),
        9985 => (Linear, Some(Nearest)),
        9986 => (Nearest, Some(Linear)),
        9987 => (Linear, Some(Linear)),
        _ => return Err(filter.fault("a filter: 9728, 9729, or 9984 to 9987")),
    };
    Ok(Minify { filter, levels })
}

fn parse_wrap(json: &Json<'_>, key: &str) -> Result<Wrap, Fault> {
    let Some(wrap) = json.field(key)? else { return Ok(Wrap::default()) };
    match wrap.unsigned()? {
        10497 => Ok(Wrap::Repeat),
        33648 => Ok(Wrap::MirroredRepeat),
        33071 => Ok(Wrap::ClampToEdge),
        _ => Err(wrap.fault("a wrapping mode: 10497, 33071 or 33648")),
    }
}
