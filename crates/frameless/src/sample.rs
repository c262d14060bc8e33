//! What is asked for and what comes back: requests, batches, answers, surfaces.

use crate::Time;

/// Width and height of the picture in pixels; both at least 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Size {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Size {
    /// # Panics
    /// If a side is zero, or if the picture has 2³² or more pixels.
    pub fn new(width: u32, height: u32) -> Size {
        assert!(
            width > 0 && height > 0,
            "a picture needs at least one pixel, got {width}×{height}"
        );
        assert!(width.checked_mul(height).is_some(), "{width}×{height} is more than 2³² pixels");
        Size { width, height }
    }

    /// Pixels in the picture.
    pub fn pixels(self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Column and row of a pixel index; row 0 is the top.
    pub fn xy(self, pixel: u32) -> (u32, u32) {
        (pixel % self.width, pixel / self.width)
    }

    /// Index of the pixel in column `x` and row `y`: `y · width + x`.
    pub fn index(self, x: u32, y: u32) -> u32 {
        debug_assert!(x < self.width && y < self.height);
        y * self.width + x
    }
}

/// One pixel to be traced.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Request {
    /// Row-major index, see [`Size::index`].
    pub pixel: u32,
    /// Where in the pixel the ray goes, in pixels from the pixel's **centre**: x to the right, y down,
    /// each in [−0.5, 0.5). `[0, 0]` is the centre.
    pub offset: [f32; 2],
    /// Number of the sample in the pixel's own sequence. A renderer that uses random numbers makes them of this and the pixel, so that
    /// the same request of an unchanged scene has the same answer; see [`crate::Tracer::is_noisy`].
    pub sample_index: u32,
}

impl Request {
    /// A ray through the pixel's centre: number 0 of its sequence.
    #[inline]
    pub fn centre(pixel: u32) -> Request {
        Request { pixel, offset: [0.0; 2], sample_index: 0 }
    }

    /// Number `sample_index` of the pixel's sequence: an additive recurrence with the plastic number (Roberts 2018, "The
    /// unreasonable effectiveness of quasirandom sequences"), whose number 0 is the centre.
    #[inline]
    pub fn in_sequence(pixel: u32, sample_index: u32) -> Request {
        const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
        // Below 2³², so that a whole number holds what is before the point: faster than a call of `fract`.
        let fract = |x: f64| x - (x as i64) as f64;
        let offset = STEPS.map(|step| (fract(0.5 + f64::from(sample_index) * step) - 0.5) as f32);
        // Rounding must not reach the next pixel.
        Request { pixel, offset: offset.map(|o| o.min(0.499_999)), sample_index }
    }

    /// Image position of the ray, in pixels from the picture's top-left **corner**; the centre of the
    /// first pixel is (0.5, 0.5).
    #[inline]
    pub fn position_px(&self, size: Size) -> [f32; 2] {
        let (x, y) = size.xy(self.pixel);
        [x as f32 + 0.5 + self.offset[0], y as f32 + 0.5 + self.offset[1]]
    }
}

/// The pixels chosen at once, all to be traced at the same time.
#[derive(Clone, Debug, PartialEq)]
pub struct Batch {
    /// Counts up from 0; an answer carries the number of its batch.
    pub id: u64,
    /// When the pixels were chosen; becomes the samples' time.
    pub now: Time,
    /// The moment of the scene to be traced, in seconds of the scene's own time: not the same as
    /// `now` once somebody pauses or scrubs.
    pub scene_secs: f64,
    /// Size of the picture that the requests' pixel indices refer to.
    pub size: Size,
    /// Which pixels, in the order in which their samples are kept. A pixel may occur twice.
    pub requests: Vec<Request>,
}

/// What a renderer says of (part of) a batch.
///
/// Pixels missing from `requests` are samples that did not come: nothing happens to them, their age grows,
/// and they are chosen again.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The batch's number.
    pub batch: u64,
    /// The batch's time.
    pub now: Time,
    /// The batch's scene time.
    pub scene_secs: f64,
    /// The size that the pixel indices refer to; answers to a batch of another size are dropped.
    pub size: Size,
    /// The requests that are answered.
    pub requests: Vec<Request>,
    /// Linear RGB radiance, one per request; finite.
    pub rgb: Vec<[f32; 3]>,
    /// What was hit: one per request, or empty if the renderer cannot tell.
    pub surfaces: Vec<Surface>,
}

impl Answer {
    /// An answer to the whole of `batch`, reusing its memory.
    pub fn to(batch: Batch, rgb: Vec<[f32; 3]>, surfaces: Vec<Surface>) -> Answer {
        let Batch { id, now, scene_secs, size, requests } = batch;
        Answer { batch: id, now, scene_secs, size, requests, rgb, surfaces }
    }
}

/// The surface that a ray hit first, in coordinates that move with the object. The default is all zeros.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surface {
    /// Which object, stable over time. [`Surface::SKY`] where nothing was hit.
    pub object: u32,
    /// Which primitive of the object; 0 where there is only one.
    pub primitive: u32,
    /// Hit point in the object's coordinates. For the sky: the ray's direction in world coordinates. For an object that
    /// deforms (see [`crate::Pose::deformed`]): the barycentric weights of the primitive's three vertices.
    pub position: [f32; 3],
    /// Unit shading normal in the object's coordinates, on the side that was hit.
    pub normal: [f32; 3],
    /// Linear RGB albedo: what part of the light is reflected diffusely.
    pub albedo: [f32; 3],
    /// Linear RGB: the part of the sample's colour that can be shaded again with other lights, as [`crate::Lighting`] says; black
    /// if the renderer cannot tell.
    pub direct: [f32; 3],
    /// Bit i: light i reaches the point, or was not tested because the surface faces away from it.
    pub lit: u32,
}

impl Surface {
    /// The object number of rays that hit nothing.
    pub const SKY: u32 = u32::MAX;
}
