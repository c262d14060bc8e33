//! The picture as a texture, and where it lies in the window.

use eframe::egui::{Painter, Pos2, Rect, TextureId, pos2, vec2};
use eframe::egui_wgpu::RenderState;
use eframe::wgpu;
use frameless::Size;

use crate::command::Picture;

/// A texture of the picture's size, written once per refresh and nothing else.
#[derive(Default)]
pub(crate) struct PictureTexture {
    current: Option<Uploaded>,
}

struct Uploaded {
    size: Size,
    texture: wgpu::Texture,
    id: TextureId,
}

impl PictureTexture {
    /// Hands the picture to the graphics driver. Kept until the next one.
    pub(crate) fn upload(&mut self, target: &RenderState, picture: &Picture) {
        let kept = self.current.take().filter(|current| current.size == picture.size);
        let current = kept.unwrap_or_else(|| Uploaded::new(target, picture.size));
        let Size { width, height } = picture.size;
        target.queue.write_texture(
            current.texture.as_image_copy(),
            picture.rgba.as_flattened(),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(4 * width),
                rows_per_image: Some(height),
            },
            current.texture.size(),
        );
        self.current = Some(current);
    }

    /// Draws the picture, if there is one yet.
    pub(crate) fn paint(&self, painter: &Painter, rect: Rect) {
        let Some(current) = &self.current else { return };
        let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        painter.image(current.id, rect, whole, eframe::egui::Color32::WHITE);
    }

    /// Width and height of the picture that is shown.
    pub(crate) fn size(&self) -> Option<Size> {
        self.current.as_ref().map(|current| current.size)
    }
}

impl Uploaded {
    fn new(target: &RenderState, size: Size) -> Uploaded {
        let texture = target.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: wgpu::Extent3d {
                width: size.width,
                height: size.height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            // Not Srgb: the window blends encoded values, and the picture is encoded already.
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        // Enlarged, pixels stay squares; reduced, none of them vanishes.
        let sampler = wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Nearest,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        };
        let id = target.renderer.write().register_native_texture_with_sampler_options(
            &target.device,
            &view,
            sampler,
        );
        Uploaded { size, texture, id }
    }
}

/// Where a picture lies in `place` (points): centred, enlarged by the largest whole number of physical pixels that
/// fits; reduced to fit where even the picture itself is too large.
pub(crate) fn lay_out(place: Rect, size: Size, pixels_per_point: f32) -> Rect {
    let picture = vec2(size.width as f32, size.height as f32);
    let room = place.size() * pixels_per_point / picture;
    let fit = room.min_elem();
    let scale = if fit >= 1.0 { fit.floor() } else { fit };
    let drawn = picture * scale / pixels_per_point;
    // On whole physical pixels, or nearest filtering doubles some columns.
    let corner = (place.center() - drawn / 2.0) * pixels_per_point;
    let corner = pos2(corner.x.floor(), corner.y.floor()) / pixels_per_point;
    Rect::from_min_size(corner, drawn)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn laid_out(width: u32, height: u32, pixels_per_point: f32) -> Rect {
        let place = Rect::from_min_size(pos2(10.0, 20.0), vec2(1000.0, 700.0));
        lay_out(place, Size::new(width, height), pixels_per_point)
    }

    #[test]
    fn small_pictures_are_enlarged_by_whole_numbers() {
        assert_eq!(laid_out(300, 200, 1.0).size(), vec2(900.0, 600.0));
        assert_eq!(laid_out(512, 384, 1.0).size(), vec2(512.0, 384.0));
        // 2 physical pixels per point: 2000 × 1400 of them.
        assert_eq!(laid_out(512, 384, 2.0).size(), vec2(768.0, 576.0));
    }

    #[test]
    fn large_pictures_are_reduced_to_fit() {
        let rect = laid_out(2000, 700, 1.0);
        assert_eq!(rect.size(), vec2(1000.0, 350.0));
    }

    #[test]
    fn the_picture_lies_in_the_middle_on_whole_pixels() {
        let rect = laid_out(511, 383, 1.0);
        assert_eq!(rect.min, pos2(254.0, 178.0));
        assert_eq!(laid_out(1000, 700, 1.0).min, pos2(10.0, 20.0));
    }
}
