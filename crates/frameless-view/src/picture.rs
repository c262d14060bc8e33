//! The picture as a texture, and where it lies in the window.
//!
//! Drawn by a shader of its own: the window toolkit's costs a software driver about 100 ns per pixel (it evaluates all
//! branches for all pixels, manual filtering with integer divisions among them).

use eframe::egui::{PaintCallbackInfo, Painter, Rect, pos2, vec2};
use eframe::egui_wgpu::{Callback, CallbackResources, CallbackTrait, RenderState};
use eframe::wgpu;
use frameless::Size;

use frameless_session::Picture;

/// A texture of the picture's size, written once per refresh, and what draws it.
pub(crate) struct PictureTexture {
    pipeline: wgpu::RenderPipeline,
    sampler: wgpu::Sampler,
    format: wgpu::TextureFormat,
    // None until the first picture.
    current: Option<Uploaded>,
}

struct Uploaded {
    size: Size,
    texture: wgpu::Texture,
    bind_group: wgpu::BindGroup,
}

impl PictureTexture {
    /// Nothing to show yet.
    pub(crate) fn new(target: &RenderState) -> PictureTexture {
        // Enlarged, pixels stay squares; reduced, none of them vanishes.
        let sampler = target.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("picture"),
            mag_filter: wgpu::FilterMode::Nearest,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        // The picture is encoded already. A target that encodes what is written needs it decoded when it is read.
        let format = match target.target_format.is_srgb() {
            true => wgpu::TextureFormat::Rgba8UnormSrgb,
            false => wgpu::TextureFormat::Rgba8Unorm,
        };
        PictureTexture { pipeline: pipeline(target), sampler, format, current: None }
    }

    /// Hands the picture to the graphics driver. Kept until the next one.
    pub(crate) fn upload(&mut self, target: &RenderState, picture: &Picture) {
        let kept = self.current.take().filter(|current| current.size == picture.size);
        let current = kept.unwrap_or_else(|| self.allocate(&target.device, picture.size));
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
        let draw = Draw { pipeline: self.pipeline.clone(), bind_group: current.bind_group.clone() };
        painter.add(Callback::new_paint_callback(rect, draw));
    }

    /// Width and height of the picture that is shown.
    pub(crate) fn size(&self) -> Option<Size> {
        self.current.as_ref().map(|current| current.size)
    }

    fn allocate(&self, device: &wgpu::Device, size: Size) -> Uploaded {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: wgpu::Extent3d {
                width: size.width,
                height: size.height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("picture"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(&view),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::Sampler(&self.sampler),
                },
            ],
        });
        Uploaded { size, texture, bind_group }
    }
}

fn pipeline(target: &RenderState) -> wgpu::RenderPipeline {
    let shader = target.device.create_shader_module(wgpu::include_wgsl!("picture.wgsl"));
    target.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("picture"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &shader,
            entry_point: Some("corner"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &shader,
            entry_point: Some("pixel"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(target.target_format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// One refresh's drawing of the picture.
struct Draw {
    pipeline: wgpu::RenderPipeline,
    bind_group: wgpu::BindGroup,
}

impl CallbackTrait for Draw {
    fn paint(
        &self,
        _: PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        _: &CallbackResources,
    ) {
        // The viewport is the callback's rectangle already.
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bind_group, &[]);
        pass.draw(0..3, 0..1);
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
