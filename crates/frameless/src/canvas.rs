//! The samples kept: one per pixel.

use crate::{Size, Time};

/// The newest sample of every pixel.
#[derive(Clone, Debug)]
pub struct Canvas {
    size: Size,
    rgb: Vec<[f32; 3]>,
    time: Vec<Time>,
}

impl Canvas {
    /// A black canvas on which no pixel has been traced yet (all times [`Time::ZERO`]).
    pub fn new(size: Size) -> Canvas {
        Canvas { size, rgb: vec![[0.0; 3]; size.pixels()], time: vec![Time::ZERO; size.pixels()] }
    }

    /// Width and height.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Linear RGB radiance per pixel, row-major.
    pub fn rgb(&self) -> &[[f32; 3]] {
        &self.rgb
    }

    /// When each pixel was traced last, row-major; [`Time::ZERO`]: never.
    pub fn time(&self) -> &[Time] {
        &self.time
    }
}
