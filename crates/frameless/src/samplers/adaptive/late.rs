//! Late looks: what goes on moving between refreshes without being carried along is traced just before the next refresh.
//!
//! ```text
//! t_k: when the refreshes were;  next one expected at t_k + min(t_k − t_{k−1}, t_{k−1} − t_{k−2})
//! n pixels ([`Canvas::last_minute`]) at m per batch: begin ⌈n / m⌉ batches before
//! ```
//!
//! The edge of a shadow crosses few pixels from one refresh to the next, but nobody knows which. Looked at any time in between they
//! are shown half an interval late on average; just before the refresh, hardly at all. Errors that were found so say nothing of how
//! fast the rest of their tile changes, and what is beside them is looked at as well: they teach no rates and begin no fronts.

use crate::traced::Mark;
use crate::{Canvas, Time};

/// The largest part of a batch that late looks get, of what holes and fronts leave.
const SHARE: f32 = 0.4;
/// The largest part of the time between two refreshes that they take.
const LONGEST: f64 = 0.5;
/// So many pixels later what is fetched is looked at.
const AHEAD: usize = 32;

/// Where in the list of pixels, and when it began.
pub(super) struct Late {
    next: usize,
    begun: Option<Mark>,
    /// The last refreshes, the newest first.
    shown_at: [Time; 3],
    last_batch: Time,
}

impl Late {
    pub(super) fn new() -> Late {
        Late { next: 0, begun: None, shown_at: [Time::ZERO; 3], last_batch: Time::ZERO }
    }

    /// After a refresh.
    pub(super) fn look(&mut self, canvas: &Canvas) {
        let [newest, before, _] = self.shown_at;
        self.shown_at = [canvas.shown_at(), newest, before];
        (self.next, self.begun) = (0, None);
    }

    /// Looks at pixels if it is time to, at the most [`SHARE`] · `wanted` of `count`.
    pub(super) fn choose(
        &mut self,
        now: Time,
        canvas: &Canvas,
        count: usize,
        wanted: f32,
        mut take: impl FnMut(u32),
    ) {
        let batch_secs = now.secs_since(std::mem::replace(&mut self.last_batch, now));
        let mut most = (SHARE * wanted * count as f32) as usize;
        if most == 0 || !self.is_time(now, canvas.last_minute().len().div_ceil(most), batch_secs) {
            return;
        }
        let begun = *self.begun.get_or_insert(Mark::at(now));
        while most > 0 {
            let Some(&pixel) = canvas.last_minute().get(self.next) else { return };
            self.next += 1;
            if let Some(&later) = canvas.last_minute().get(self.next + AHEAD) {
                canvas.traced().prefetch(canvas.traced().place(later));
            }
            if begun.since(canvas.mark(pixel)) > 0 {
                take(pixel);
                most -= 1;
            }
        }
    }

    fn is_time(&self, now: Time, batches: usize, batch_secs: f64) -> bool {
        let [newest, before, oldest] = self.shown_at;
        let interval_secs = newest.secs_since(before).min(before.secs_since(oldest));
        let due_secs = interval_secs - now.secs_since(newest);
        due_secs <= (batches as f64 * batch_secs).min(LONGEST * interval_secs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    const MILLISECOND: u64 = 1_000_000;

    /// Refreshed at 0, 16 and 32 ms, with so many pixels to be looked at late.
    fn refreshed(pixels: u32) -> (Canvas, Late) {
        let size = Size::new(64, 64);
        let mut canvas = Canvas::from_picture(size, vec![[0.0; 3]; size.pixels()]);
        let mut late = Late::new();
        for refresh in 0..3 {
            let now = Time(refresh * 16 * MILLISECOND);
            canvas.update(now, canvas.traced().tiles().to_vec(), Vec::new());
            late.look(&canvas);
        }
        canvas.set_last_minute(&mut (0..pixels).collect());
        (canvas, late)
    }

    /// Which pixels are looked at in the batches of 100 of the next 16 ms, and how many milliseconds after the refresh.
    fn looks(canvas: &mut Canvas, late: &mut Late, wanted: f32) -> Vec<(u64, u32)> {
        let mut looks = Vec::new();
        for millis in 0..16 {
            let now = Time((32 + millis) * MILLISECOND);
            let begin = looks.len();
            late.choose(now, canvas, 100, wanted, |pixel| looks.push((millis, pixel)));
            for &(_, pixel) in &looks[begin..] {
                canvas.replace(pixel, now, [0.0; 3]);
            }
        }
        looks
    }

    #[test]
    fn all_are_looked_at_once_in_the_last_batches_before_the_refresh() {
        let (mut canvas, mut late) = refreshed(100);
        let looks = looks(&mut canvas, &mut late, 1.0);
        assert_eq!(looks.iter().map(|look| look.1).collect::<Vec<_>>(), Vec::from_iter(0..100));
        // 40 per batch: three batches before 16 ms.
        assert_eq!((looks[0].0, looks[99].0), (13, 15));
    }

    #[test]
    fn too_many_begin_half_way_and_the_last_are_left() {
        let (mut canvas, mut late) = refreshed(1000);
        let looks = looks(&mut canvas, &mut late, 1.0);
        assert_eq!((looks[0].0, looks.len()), (8, 8 * 40));
    }

    #[test]
    fn who_has_been_traced_meanwhile_is_left_out() {
        let (mut canvas, mut late) = refreshed(40);
        canvas.replace(7, Time(47 * MILLISECOND), [0.0; 3]);
        let looks = looks(&mut canvas, &mut late, 1.0);
        assert!(looks.len() == 39 && looks.iter().all(|look| look.1 != 7), "{looks:?}");
    }

    #[test]
    fn nobody_is_looked_at_if_that_is_not_wanted() {
        let (mut canvas, mut late) = refreshed(40);
        assert!(looks(&mut canvas, &mut late, 0.0).is_empty());
    }
}
