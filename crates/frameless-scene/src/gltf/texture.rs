//! Textures: an image, and how it is looked up. Only images that a material shows are decoded, each once.

use std::collections::HashMap;

use glam::DVec4;

use crate::{Filter, Image, Texture, TextureRef, Wrap};

use super::document::Document;
use super::error::Fault;
use super::image::FileImage;
use super::json::Json;

/// The file's textures, and those that the scene has got so far.
pub(super) struct Textures<'a> {
    file_images: Vec<FileImage<'a>>,
    file_textures: Vec<FileTexture>,
    texture_of: HashMap<usize, u32>,
    image_of: HashMap<usize, u32>,
    pub(super) textures: Vec<Texture>,
    pub(super) images: Vec<Image>,
}

/// A texture of the file; its references are in bounds.
#[derive(Clone, Copy)]
struct FileTexture {
    image: Option<usize>,
    wrap: [Wrap; 2],
    filter: Filter,
}

impl<'a> Textures<'a> {
    pub(super) fn parse(root: &Json<'a>, view_count: usize) -> Result<Textures<'a>, Fault> {
        let images = root.list("images")?;
        let file_images = images.iter().map(|json| FileImage::parse(json, view_count));
        let file_images = file_images.collect::<Result<Vec<_>, Fault>>()?;
        let samplers = root.list("samplers")?;
        let samplers = samplers.iter().map(parse_sampler).collect::<Result<Vec<_>, Fault>>()?;
        let textures = root.list("textures")?;
        let file_textures =
            textures.iter().map(|json| FileTexture::parse(json, &samplers, file_images.len()));
        Ok(Textures {
            file_textures: file_textures.collect::<Result<_, Fault>>()?,
            file_images,
            texture_of: HashMap::new(),
            image_of: HashMap::new(),
            textures: Vec::new(),
            images: Vec::new(),
        })
    }

    /// The texture that a material refers to with `info`; `owner` is the material's.
    pub(super) fn refer(
        &mut self,
        info: &Json<'_>,
        owner: &str,
        document: &mut Document<'_>,
    ) -> Result<Option<TextureRef>, Fault> {
        let file_texture = self.check(info)?;
        if info.extension("KHR_texture_transform")?.is_some() {
            document.warnings.about("texture transforms are not applied", owner);
        }
        let uv_set = info.unsigned_or("texCoord", 0)?;
        if uv_set > 1 {
            let what = "textures with texture coordinates beyond set 1 are not drawn";
            document.warnings.about(what, owner);
            return Ok(None);
        }
        let texture = self.texture(file_texture, document);
        Ok(texture.map(|texture| TextureRef { texture, uv_set: uv_set as u32 }))
    }

    /// Refuses an `info` that refers to no texture; returns the index of the file's texture.
    pub(super) fn check(&self, info: &Json<'_>) -> Result<usize, Fault> {
        info.required("index")?.index(self.file_textures.len(), "textures")
    }

    /// The mean of the texture that `info` refers to, with RGB made linear.
    pub(super) fn mean(
        &self,
        info: &Json<'_>,
        decode_srgb: bool,
        document: &mut Document<'_>,
    ) -> Result<Option<DVec4>, Fault> {
        let image = self.file_textures[self.check(info)?].image;
        Ok(image.and_then(|image| self.file_images[image].mean(decode_srgb, document)))
    }

    fn texture(&mut self, file_texture: usize, document: &mut Document<'_>) -> Option<u32> {
        if let Some(&known) = self.texture_of.get(&file_texture) {
            return Some(known);
        }
        let FileTexture { image, wrap, filter } = self.file_textures[file_texture];
        let Some(image) = image else {
            let whom = format!("/textures/{file_texture}");
            document.warnings.about("textures without a readable image are not drawn", whom);
            return None;
        };
        let image = self.image(image, document);
        let index = self.textures.len() as u32;
        self.textures.push(Texture { image, wrap, filter });
        self.texture_of.insert(file_texture, index);
        Some(index)
    }

    fn image(&mut self, file_image: usize, document: &mut Document<'_>) -> u32 {
        if let Some(&known) = self.image_of.get(&file_image) {
            return known;
        }
        let index = self.images.len() as u32;
        self.images.push(self.file_images[file_image].decode(document));
        self.image_of.insert(file_image, index);
        index
    }
}

impl FileTexture {
    fn parse(
        json: &Json<'_>,
        samplers: &[([Wrap; 2], Filter)],
        image_count: usize,
    ) -> Result<FileTexture, Fault> {
        let (wrap, filter) = match json.field("sampler")? {
            Some(sampler) => samplers[sampler.index(samplers.len(), "samplers")?],
            None => Default::default(),
        };
        let mut image = None;
        let webp = json.extension("EXT_texture_webp")?;
        for holder in webp.iter().chain([json]) {
            if let Some(source) = holder.field("source")? {
                let source = source.index(image_count, "images")?;
                image = image.or(Some(source));
            }
        }
        Ok(FileTexture { image, wrap, filter })
    }
}

fn parse_sampler(json: &Json<'_>) -> Result<([Wrap; 2], Filter), Fault> {
    let filter = match json.field("magFilter")? {
        None => Filter::default(),
        Some(filter) => match filter.unsigned()? {
            9728 => Filter::Nearest,
            9729 => Filter::Linear,
            _ => return Err(filter.fault("a filter: 9728 or 9729")),
        },
    };
    Ok(([parse_wrap(json, "wrapS")?, parse_wrap(json, "wrapT")?], filter))
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
