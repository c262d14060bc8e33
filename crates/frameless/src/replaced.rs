//! The samples of one answer and what they took the place of.

use crate::{Answer, Canvas, Kept, Observation, Request, Size, Surface, Time};

/// So many samples later what is prefetched is used.
const AHEAD: usize = 32;

/// In the answer's order; what has been dropped is not among them.
#[derive(Default)]
pub(crate) struct Replaced {
    pub(crate) requests: Vec<Request>,
    /// But for what they changed, which is found out later.
    pub(crate) told: Vec<Observation>,
    /// Whether each was added to others, so that none was replaced.
    added: Vec<bool>,
    pub(crate) old: Vec<[f32; 3]>,
    pub(crate) new: Vec<[f32; 3]>,
    pub(crate) surfaces: Vec<Surface>,
}

/// What a pixel was.
#[derive(Clone, Copy)]
pub(crate) struct Before {
    /// When it had been traced.
    pub(crate) previous: Time,
    /// Whether anything was known of it.
    pub(crate) known: bool,
    /// Whether the sample was added to others, so that none was replaced.
    pub(crate) is_refinement: bool,
    /// Whether that was later than the sample, which is not kept.
    pub(crate) is_newer: bool,
}

impl Replaced {
    pub(crate) fn clear(&mut self) {
        self.requests.clear();
        self.told.clear();
        self.added.clear();
        self.old.clear();
        self.new.clear();
        self.surfaces.clear();
    }

    /// Puts the first `count` samples of an answer on the canvas, and notes what each replaced. Returns how many came too late.
    ///
    /// They are taken from the answer, which gets this memory, emptied before, for it. Only memory is moved here, and fetched some samples
    /// ahead; what the samples changed is worked out afterwards, from what is noted here.
    pub(crate) fn put(&mut self, answer: &mut Answer, count: usize, canvas: &mut Canvas) -> usize {
        std::mem::swap(&mut self.requests, &mut answer.requests);
        std::mem::swap(&mut self.new, &mut answer.rgb);
        std::mem::swap(&mut self.surfaces, &mut answer.surfaces);
        self.requests.truncate(count);
        self.new.truncate(count);
        self.surfaces.truncate(count);
        self.old.resize(count, [0.0; 3]);
        self.added.resize(count, false);
        let (now, mut late) = (answer.now.as_kept(), 0);
        let samples = &self.requests;
        let replaced = samples.iter().zip(&self.new).zip(self.old.iter_mut().zip(&mut self.added));
        self.told.extend(replaced.enumerate().map(|(i, ((request, &rgb), (old, added)))| {
            if let Some(later) = samples.get(i + AHEAD) {
                canvas.prefetch(later.pixel);
            }
            let before = canvas.put(request, answer.now, rgb, old);
            *added = before.is_refinement;
            late += usize::from(before.is_newer);
            let Before { previous, known, .. } = before;
            Observation {
                pixel: request.pixel,
                now,
                previous,
                known,
                change: 0.0,
                refinement: None,
            }
        }));
        if late > 0 {
            self.leave_out_late();
        }
        late
    }

    #[cold]
    fn leave_out_late(&mut self) {
        let is_late: Vec<bool> = self.told.iter().map(|told| told.previous > told.now).collect();
        fn keep<T>(some: &mut Vec<T>, is_late: &[bool]) {
            let mut is_late = is_late.iter();
            some.retain(|_| is_late.next().is_some_and(|is_late| !is_late));
        }
        keep(&mut self.requests, &is_late);
        keep(&mut self.told, &is_late);
        keep(&mut self.added, &is_late);
        keep(&mut self.old, &is_late);
        keep(&mut self.new, &is_late);
        keep(&mut self.surfaces, &is_late);
    }

    /// The pixels of which the newest sample is among these.
    pub(crate) fn newest(&self) -> impl Iterator<Item = u32> {
        let pixels = self.requests.iter().map(|request| request.pixel);
        pixels.zip(&self.added).filter(|(_, added)| !**added).map(|(pixel, _)| pixel)
    }

    /// As a reconstruction takes them.
    pub(crate) fn kept(&self, now: Time, size: Size, is_noisy: bool) -> Kept<'_> {
        let Replaced { requests, old, new, surfaces, .. } = self;
        Kept { now, size, requests, new, old, surfaces, is_noisy }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ticks of a canvas's times.
    const TICK: u64 = 1 << 14;

    fn answer(ticks: u64, requests: &[Request]) -> Answer {
        let (now, size) = (Time(ticks * TICK), Size::new(4, 1));
        let surface = |request: &Request| Surface { object: request.pixel, ..Surface::default() };
        Answer {
            batch: 0,
            now,
            scene_secs: 0.0,
            size,
            requests: requests.to_vec(),
            rgb: requests.iter().map(|request| [ticks as f32 + request.pixel as f32; 3]).collect(),
            surfaces: requests.iter().map(surface).collect(),
        }
    }

    fn put(answer: &mut Answer, count: usize, canvas: &mut Canvas) -> (Replaced, usize) {
        let mut replaced = Replaced::default();
        let late = replaced.put(answer, count, canvas);
        (replaced, late)
    }

    #[test]
    fn what_comes_too_late_is_left_out_of_everything() {
        let mut canvas = Canvas::from_picture(Size::new(4, 1), vec![[0.5; 3]; 4]);
        put(&mut answer(10, &[Request::centre(1)]), 1, &mut canvas);
        let (replaced, late) =
            put(&mut answer(5, &[0, 1, 2, 3].map(Request::centre)), 3, &mut canvas);
        assert_eq!(late, 1);
        assert_eq!(replaced.requests, [0, 2].map(Request::centre), "and the fourth is not wanted");
        assert_eq!(
            (&replaced.new[..], &replaced.old[..]),
            (&[[5.0; 3], [7.0; 3]][..], &[[0.5; 3]; 2][..])
        );
        let objects: Vec<u32> = replaced.surfaces.iter().map(|surface| surface.object).collect();
        assert_eq!((objects, Vec::from_iter(replaced.newest())), (vec![0, 2], vec![0, 2]));
        let told: Vec<_> = replaced.told.iter().map(|t| (t.pixel, t.now.0, t.previous.0)).collect();
        assert_eq!(told, [(0, 5 * TICK, 0), (2, 5 * TICK, 0)]);
        assert_eq!(canvas.rgb(), [[5.0; 3], [11.0; 3], [7.0; 3], [0.5; 3]]);
        let times: Vec<u64> = canvas.time().map(|time| time.0 / TICK).collect();
        assert_eq!(times, [5, 10, 5, 0]);
    }

    #[test]
    fn what_is_added_to_others_replaces_nothing() {
        let mut canvas = Canvas::from_picture(Size::new(4, 1), vec![[0.5; 3]; 4]);
        canvas.set_samples(16, &[0, 1, 1, 0]);
        let further = [0, 1].map(|pixel| Request::in_sequence(pixel, 3));
        let requests = [further[0], further[1], Request::centre(2), Request::centre(3)];
        let (replaced, late) = put(&mut answer(9, &requests), 3, &mut canvas);
        assert_eq!((late, Vec::from_iter(replaced.newest())), (0, vec![0, 2]), "0 does not rest");
        let lengths = [replaced.requests.len(), replaced.new.len(), replaced.surfaces.len()];
        assert_eq!(lengths, [3; 3], "the fourth is not wanted");
        assert_eq!(canvas.rgb(), [[9.0; 3], [0.5; 3], [11.0; 3], [0.5; 3]]);
        assert_eq!(canvas.samples(), [0, 2, 1, 0]);
    }
}
