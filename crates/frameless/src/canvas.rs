//! The samples kept: the newest of every pixel.

use crate::pages::await_large_pages;
use crate::replaced::Before;
use crate::traced::{Mark, TileMarks, Traced};
use crate::wide;
use crate::{Request, Size, Time};

/// The newest sample of every pixel: its linear colour and its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Canvas {
    size: Size,
    generation: u32,
    rgb: Vec<[f32; 3]>,
    traced: Traced,
    holes: Vec<u32>,
    last_minute: Vec<u32>,
    updates: u64,
    shown_at: Time,
    samples: Vec<u16>,
    samples_wanted: u16,
    tile_contrast: Vec<f32>,
    tile_motion: Vec<Option<[f32; 2]>>,
}

impl Canvas {
    /// A black canvas on which no pixel has been traced yet (all times [`Time::ZERO`]).
    pub fn new(size: Size) -> Canvas {
        let black = vec![[0.0; 3]; size.pixels()];
        await_large_pages(&black);
        let mut canvas = Canvas::from_picture(size, black);
        canvas.traced = Traced::new(size, false);
        canvas.holes = coarse_to_fine(size);
        canvas.updates = 1;
        canvas
    }

    /// A canvas that starts with a whole picture traced at [`Time::ZERO`].
    ///
    /// # Panics
    /// If `rgb` (linear, row-major) does not have one colour per pixel.
    pub fn from_picture(size: Size, rgb: Vec<[f32; 3]>) -> Canvas {
        assert_eq!(rgb.len(), size.pixels(), "one colour per pixel");
        Canvas {
            size,
            generation: 0,
            rgb,
            traced: Traced::new(size, true),
            holes: Vec::new(),
            last_minute: Vec::new(),
            updates: 0,
            shown_at: Time::ZERO,
            samples: Vec::new(),
            samples_wanted: 0,
            tile_contrast: Vec::new(),
            tile_motion: Vec::new(),
        }
    }

    /// Width and height.
    pub fn size(&self) -> Size {
        self.size
    }

    /// How often the canvas has been resized. Whoever keeps sums over a canvas makes them anew when this has changed: after a
    /// resize there and back the size is the same, but the samples are not.
    pub fn generation(&self) -> u32 {
        self.generation
    }

    /// Linear RGB radiance per pixel, row-major.
    pub fn rgb(&self) -> &[[f32; 3]] {
        &self.rgb
    }

    /// When each pixel was traced last, row-major; [`Time::ZERO`]: never. Times are kept in units of 2¹⁴ ns (16 µs), rounded down, and no
    /// longer than nine hours. Samples that are added to others of a pixel at rest do not count: they do not tell whether anything has
    /// changed.
    pub fn time(&self) -> impl Iterator<Item = Time> {
        self.traced.marks().map(|mark| self.traced.time(mark))
    }

    /// As [`Canvas::time`], of one pixel.
    pub fn time_of(&self, pixel: u32) -> Time {
        self.traced.time(self.mark(pixel))
    }

    /// Per pixel whether anything is known of what it shows, row-major: not before it is traced first, and not where
    /// something has moved away, until what was behind it has been traced.
    pub fn known(&self) -> impl Iterator<Item = bool> {
        self.traced.marks().map(Mark::is_known)
    }

    /// As [`Canvas::known`], of one pixel.
    pub fn is_known(&self, pixel: u32) -> bool {
        self.mark(pixel).is_known()
    }

    /// When all pixels were traced, tile by tile.
    pub(crate) fn traced(&self) -> &Traced {
        &self.traced
    }

    #[inline(always)]
    pub(crate) fn mark(&self, pixel: u32) -> Mark {
        self.traced.mark(self.traced.place(pixel))
    }

    /// Pixels that wait to be traced, the most urgent first: those of which nothing is known, then those that are shown by
    /// samples beside their centres although nothing moves any more.
    pub fn holes(&self) -> &[u32] {
        &self.holes
    }

    /// Pixels best traced shortly before the next refresh: what they show goes on moving until then, and nothing carries it along.
    pub fn last_minute(&self) -> &[u32] {
        &self.last_minute
    }

    /// When a reconstruction has last said what the pixels show.
    pub(crate) fn shown_at(&self) -> Time {
        self.shown_at
    }

    /// Whether a pixel has not been traced since [`Canvas::holes`] was made.
    pub fn still_waits(&self, pixel: u32) -> bool {
        let mark = self.mark(pixel);
        !mark.is_known() || Mark::at(self.shown_at).since(mark) >= 0
    }

    /// Of how many samples each pixel shows the mean, row-major; 0 where the picture does not rest. Empty if nobody adds samples up.
    pub fn samples(&self) -> &[u16] {
        &self.samples
    }

    /// How many samples a pixel at rest is to have; 0: they are not added up.
    pub fn samples_wanted(&self) -> u16 {
        self.samples_wanted
    }

    /// Whether samples are added for as long as a pixel rests, since the renderer has noise.
    pub fn adds_without_end(&self) -> bool {
        self.samples_wanted == u16::MAX
    }

    /// Spatial contrast of every tile of the sampler's [`Rates`](crate::Rates) in the picture before the last: mean squared difference of
    /// neighbouring pixels, per channel, display-referred. Empty if nobody has said.
    pub fn tile_contrast(&self) -> &[f32] {
        &self.tile_contrast
    }

    /// How far what is seen in the middle of every such tile has moved between the last two refreshes, in pixels; `None` where that
    /// is not known. Empty if nobody has said, or wanted to know.
    pub fn tile_motion(&self) -> &[Option<[f32; 2]>] {
        &self.tile_motion
    }

    /// How often a reconstruction has said anew what the pixels show: then all of [`Canvas::time`], [`Canvas::known`] and
    /// [`Canvas::holes`] may have changed without a sample.
    pub fn updates(&self) -> u64 {
        self.updates
    }

    /// The marks of all tiles and [`Canvas::holes`], to be changed where they are and then given to [`Canvas::update`]. The canvas is
    /// without them until then.
    pub(crate) fn lend(&mut self) -> (Vec<TileMarks>, Vec<u32>) {
        (self.traced.lend(), std::mem::take(&mut self.holes))
    }

    /// What every pixel shows has been found out anew: when it was traced, whether it is known, and who waits to be traced.
    ///
    /// # Panics
    /// If there is not one mark per pixel.
    pub(crate) fn update(&mut self, now: Time, marks: Vec<TileMarks>, holes: Vec<u32>) {
        self.shown_at = now;
        self.holes = holes;
        self.traced.replace(now, marks);
        self.updates += 1;
    }

    /// Of how many samples each pixel shows the mean from now on, and how many are wanted. `count` may be empty: none rests.
    pub(crate) fn set_samples(&mut self, wanted: u16, count: &[u16]) {
        self.samples_wanted = wanted;
        count.clone_into(&mut self.samples);
    }

    /// Pixels to be traced shortly before the next refresh. The old vector is handed back, to be used again.
    pub(crate) fn set_last_minute(&mut self, pixels: &mut Vec<u32>) {
        std::mem::swap(&mut self.last_minute, pixels);
    }

    /// What the tiles show; see [`Canvas::tile_contrast`] and [`Canvas::tile_motion`].
    pub(crate) fn set_tiles(
        &mut self,
        contrast: &[f32],
        motion: impl Iterator<Item = Option<[f32; 2]>>,
    ) {
        contrast.clone_into(&mut self.tile_contrast);
        self.tile_motion.clear();
        self.tile_motion.extend(motion);
    }

    /// Begins to fetch what is known of a pixel.
    #[inline(always)]
    pub(crate) fn prefetch(&self, pixel: u32) {
        let i = pixel as usize;
        wide::prefetch(&self.rgb, i);
        wide::prefetch(&self.samples, i);
        self.traced.prefetch(self.traced.place(pixel));
    }

    /// Whether a pixel rests, so that further samples can be added to its own.
    #[inline(always)]
    pub(crate) fn rests(&self, pixel: u32) -> bool {
        self.samples.get(pixel as usize).is_some_and(|&samples| samples > 0)
    }

    /// A sample: added to those of a pixel at rest, of which the colour and time of the one at its centre stay; else it takes the place of
    /// what is there, if that is not newer. `old`: that colour. Returns what the pixel was.
    #[inline(always)]
    pub(crate) fn put(
        &mut self,
        request: &Request,
        time: Time,
        rgb: [f32; 3],
        old: &mut [f32; 3],
    ) -> Before {
        let pixel = request.pixel;
        let (i, place) = (pixel as usize, self.traced.place(pixel));
        let mark = self.traced.mark(place);
        let (previous, known) = (self.traced.time(mark), mark.is_known());
        *old = self.rgb[i];
        let is_newer = time < previous;
        let is_refinement = !is_newer && request.sample_index > 0 && self.rests(pixel);
        if is_refinement {
            self.samples[i] = self.samples[i].saturating_add(1);
        } else if !is_newer {
            self.traced.set(place, time);
            self.rgb[i] = rgb;
        }
        Before { previous, known, is_refinement, is_newer }
    }

    /// Becomes a copy of a canvas as far as a reconstruction changes what is there; it replaces all else but the colours.
    pub(crate) fn copy_times(&mut self, other: &Canvas) {
        self.traced.clone_from(&other.traced);
        (self.size, self.generation) = (other.size, other.generation);
        (self.shown_at, self.updates) = (other.shown_at, other.updates);
    }

    /// Takes over what a copy has been told since; its memory is handed back.
    pub(crate) fn take_all_but_colours(&mut self, copy: &mut Canvas) {
        assert_eq!(
            (copy.size, copy.generation),
            (self.size, self.generation),
            "a copy of this one"
        );
        std::mem::swap(self, copy);
        std::mem::swap(&mut self.rgb, &mut copy.rgb);
    }

    /// A sample of this time has been written to the canvas that this is a copy of.
    pub(crate) fn note(&mut self, pixel: u32, time: Time) {
        self.traced.set(self.traced.place(pixel), time);
    }

    /// Puts a sample at a pixel's centre there; returns the time and colour that it replaces.
    #[cfg(test)]
    pub(crate) fn replace(&mut self, pixel: u32, time: Time, rgb: [f32; 3]) -> (Time, [f32; 3]) {
        let mut old = rgb;
        let before = self.put(&Request::centre(pixel), time, rgb, &mut old);
        (before.previous, old)
    }

    /// The same picture in another size: every pixel takes the sample nearest to its centre, age included.
    pub fn resized(&self, size: Size) -> Canvas {
        let nearest = |i: u32, to: u32, from: u32| {
            // Centre of pixel i of `to`, in pixels of `from`, without rounding error.
            ((2 * u64::from(i) + 1) * u64::from(from) / (2 * u64::from(to))) as u32
        };
        let source: Vec<usize> = (0..size.pixels() as u32)
            .map(|pixel| {
                let (x, y) = size.xy(pixel);
                let from_x = nearest(x, size.width, self.size.width);
                let from_y = nearest(y, size.height, self.size.height);
                self.size.index(from_x, from_y) as usize
            })
            .collect();
        Canvas {
            size,
            generation: self.generation.wrapping_add(1),
            rgb: source.iter().map(|&i| self.rgb[i]).collect(),
            traced: self.traced.resized(size, |pixel| source[pixel as usize] as u32),
            holes: coarse_to_fine(size),
            last_minute: Vec::new(),
            updates: self.updates + 1,
            shown_at: self.shown_at,
            samples: Vec::new(),
            samples_wanted: 0,
            tile_contrast: Vec::new(),
            tile_motion: Vec::new(),
        }
    }
}

/// All pixels in an order that covers the picture evenly at every moment: bit-reversed blocks of 32×32, interleaved (Bayer
/// 1973).
fn coarse_to_fine(size: Size) -> Vec<u32> {
    const BITS: u32 = 5;
    let mut pixels = Vec::with_capacity(size.pixels());
    for (x0, y0) in crate::bayer::order(BITS) {
        for y in (y0..size.height).step_by(1 << BITS) {
            pixels.extend((x0..size.width).step_by(1 << BITS).map(|x| size.index(x, y)));
        }
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(width: u32, height: u32) -> Canvas {
        let size = Size::new(width, height);
        Canvas::from_picture(size, (0..size.pixels()).map(|i| [i as f32; 3]).collect())
    }

    #[test]
    fn resizing_there_and_back_keeps_the_picture() {
        let canvas = numbered(7, 5);
        let back = canvas.resized(Size::new(21, 15)).resized(Size::new(7, 5));
        assert_eq!(
            (back.size(), back.rgb(), Vec::from_iter(back.time())),
            (canvas.size(), canvas.rgb(), Vec::from_iter(canvas.time()))
        );
        assert_eq!((canvas.generation(), back.generation()), (0, 2));
    }

    #[test]
    fn resizing_to_one_pixel_takes_the_middle() {
        assert_eq!(numbered(3, 3).resized(Size::new(1, 1)).rgb(), [[4.0; 3]]);
    }

    #[test]
    fn replacing_returns_what_was_there() {
        let mut canvas = numbered(2, 1);
        let [tick, later] = [1 << 14, 3 << 14].map(Time);
        assert_eq!(canvas.replace(1, tick, [9.0; 3]), (Time::ZERO, [1.0; 3]));
        assert_eq!(canvas.replace(1, Time(later.0 + 99), [0.0; 3]), (tick, [9.0; 3]));
        assert_eq!(canvas.time_of(1), later, "rounded down");
    }

    #[test]
    fn an_untraced_picture_is_one_hole_of_all_pixels_from_coarse_to_fine() {
        for size in [Size::new(1, 1), Size::new(70, 50), Size::new(32, 64)] {
            let canvas = Canvas::new(size);
            let mut sorted: Vec<u32> = (0..size.pixels() as u32).collect();
            sorted.sort_by_key(|&pixel| {
                let (x, y) = size.xy(pixel);
                crate::bayer::rank(x, y, 5)
            });
            assert_eq!(canvas.holes(), sorted);
        }
    }
}
